//! What goes wrong is told, and nothing panics.

use crate::adapter::gpu;
use crate::setup::cameras;
use farfield_gpu::{
    Canvas, Compared, Comparison, Display, GpuError, GpuScene, IdBuffers, LayerSearch, wgpu,
};
use farfield_grid::Grid;
use farfield_scene::{Image, Scene};
use farfield_views::Camera;

/// A device that is gone is told by all that is asked of it.
#[test]
fn a_lost_device_is_an_error_everywhere() {
    let Some(gpu) = gpu() else { return };
    let scene = farfield_town::house(1);
    let uploaded = GpuScene::new(&gpu, &scene).unwrap();
    let ids = IdBuffers::new(&gpu).unwrap();
    let display = Display::new(&gpu, Display::OFFSCREEN).unwrap();
    let search = LayerSearch::new(&gpu).unwrap();
    let (cameras, all) = (cameras(&scene, 32), uploaded.all());
    let light = crate::display::light();
    assert!(ids.see(&gpu, &uploaded, &all, &cameras).is_ok());

    let size = [cameras[0].width, cameras[0].height];
    let [mut canvas, second] = [0; 2].map(|_| Canvas::new(&gpu, size).unwrap());
    let comparison = Comparison::new(&gpu).unwrap();
    let target = Comparison::target(&gpu, size).unwrap();
    let is_timed = canvas.is_timed();

    gpu.device().destroy();
    let _ = gpu.device().poll(wgpu::PollType::Poll);
    let compared = [&canvas, &second];
    let mut errors = vec![
        ids.see(&gpu, &uploaded, &all, &cameras).err(),
        display
            .pictures(&gpu, &uploaded, &all, &cameras, &light)
            .err(),
        search
            .find(&gpu, &scene, &cameras[0], &[1.0, 2.0], &[])
            .err(),
        comparison
            .draw(&gpu, compared, Compared::First, [0.0; 3], &target)
            .err(),
        Comparison::read(&gpu, &target).err(),
        canvas
            .draw(&gpu, &display, &uploaded, &all, &cameras[0], &light)
            .err(),
        GpuScene::new(&gpu, &scene).err(),
        IdBuffers::new(&gpu).err(),
        LayerSearch::new(&gpu).err(),
        Display::new(&gpu, Display::OFFSCREEN).err(),
        Canvas::new(&gpu, size).err(),
        Comparison::new(&gpu).err(),
        Comparison::target(&gpu, size).err(),
    ];
    // Where no times are told, nothing is asked of the device.
    if is_timed {
        errors.push(canvas.gpu_milliseconds(&gpu).err());
    }
    for error in errors {
        assert!(matches!(error, Some(GpuError::Lost { .. })), "{error:?}");
    }
}

/// Images and pictures that are too large are refused with the limit, and the device lives on.
#[test]
fn what_is_too_large_is_refused_with_the_limit() {
    let Some(gpu) = gpu() else { return };
    let limit = gpu.device().limits().max_texture_dimension_2d;
    let mut scene = farfield_town::house(1);
    let ids = IdBuffers::new(&gpu).unwrap();
    let uploaded = GpuScene::new(&gpu, &scene).unwrap();
    let wide = Camera {
        width: limit + 1,
        height: 1,
        ..cameras(&scene, 32)[0]
    };
    let refused = ids
        .see(&gpu, &uploaded, &uploaded.all(), &[wide])
        .unwrap_err();
    let message = refused.to_string();
    assert!(message.contains("max_texture_dimension_2d"), "{message}");
    assert!(message.contains(&format!("{} x 1", limit + 1)), "{message}");

    scene.images.push(Image {
        name: "banner".into(),
        width: limit + 1,
        height: 1,
        texels: vec![[255; 4]; limit as usize + 1],
    });
    scene.textures.push(farfield_scene::Texture {
        image: scene.images.len() as u32 - 1,
        wrap: [farfield_scene::Wrap::Repeat; 2],
        filter: farfield_scene::Filter::Linear,
    });
    scene.materials[0].base_color_texture = Some(scene.textures.len() as u32 - 1);
    let message = GpuScene::new(&gpu, &scene).unwrap_err().to_string();
    assert!(message.contains("banner"), "{message}");
    assert!(
        message.ends_with(&format!("max_texture_dimension_2d is {limit}")),
        "{message}"
    );

    let fine = cameras(&farfield_town::house(1), 32);
    assert!(ids.see(&gpu, &uploaded, &uploaded.all(), &fine).is_ok());
}

/// A target of another format than comparisons have is an error, no panic.
#[test]
fn a_target_that_does_not_fit_is_an_error() {
    let Some(gpu) = gpu() else { return };
    let comparison = Comparison::new(&gpu).unwrap();
    let [first, second] = [0; 2].map(|_| Canvas::new(&gpu, [1, 1]).unwrap());
    let target = gpu.device().create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d::default(),
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::R8Unorm,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
        view_formats: &[],
    });
    let draw = |target: &wgpu::Texture| {
        let canvases = [&first, &second];
        comparison.draw(&gpu, canvases, Compared::First, [0.0; 3], target)
    };
    let drawn = draw(&target);
    assert!(matches!(drawn, Err(GpuError::Failed { .. })), "{drawn:?}");
    assert!(draw(&Comparison::target(&gpu, [1, 1]).unwrap()).is_ok());
}

/// A scene of nothing is seen as nothing.
#[test]
fn nothing_is_seen_of_an_empty_scene() {
    let Some(gpu) = gpu() else { return };
    let uploaded = GpuScene::new(&gpu, &Scene::default()).unwrap();
    let camera = cameras(&farfield_town::house(1), 16)[0];
    let ids = IdBuffers::new(&gpu).unwrap();
    let seen = ids
        .see(&gpu, &uploaded, &uploaded.all(), &[camera])
        .unwrap();
    let nothing = |ids: &Grid<u32>| ids.cells().iter().all(|id| *id == farfield_gpu::NONE);
    assert!(nothing(&seen[0].objects) && nothing(&seen[0].triangles));
    let depths = seen[0].depth.cells();
    assert!(depths.iter().all(|depth| *depth == f32::INFINITY));
}
