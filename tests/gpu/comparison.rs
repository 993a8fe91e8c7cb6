//! Pictures that are drawn again and again, and two of them seen as one.

use crate::adapter::gpu;
use crate::display::light;
use crate::setup::cameras;
use farfield_gpu::{Canvas, Compared, Comparison, Display, Gpu, GpuError, GpuScene};
use farfield_grid::Grid;
use farfield_views::Camera;

const BACKGROUND: [f32; 3] = [1.0, 0.2, 0.0];

fn canvas(gpu: &Gpu, display: &Display, scene: &GpuScene, camera: &Camera) -> Canvas {
    let mut canvas = Canvas::new(gpu, [camera.width, camera.height]).unwrap();
    let draws = scene.all();
    canvas
        .draw(gpu, display, scene, &draws, camera, &light())
        .unwrap();
    canvas
}

fn compared(gpu: &Gpu, canvases: [&Canvas; 2], compared: Compared) -> Grid<[u8; 4]> {
    let comparison = Comparison::new(gpu).unwrap();
    let target = Comparison::target(gpu, canvases[0].size()).unwrap();
    let drawn = comparison.draw(gpu, canvases, compared, BACKGROUND, &target);
    drawn.unwrap();
    Comparison::read(gpu, &target).unwrap()
}

fn over_background([r, g, b, a]: [u8; 4]) -> [u8; 4] {
    match a {
        0 => [255, 51, 0, 255],
        _ => [r, g, b, 255],
    }
}

/// Canvases show what pictures do, to the last bit, whatever was drawn on them before, and a comparison is
/// what it says at each pixel.
#[test]
fn comparisons_are_made_of_pictures() {
    let Some(gpu) = gpu() else { return };
    let scene = farfield_town::house(1);
    let uploaded = GpuScene::new(&gpu, &scene).unwrap();
    let display = Display::new(&gpu, Canvas::FORMAT).unwrap();
    let cameras = &cameras(&scene, 96)[..2];
    let pictures = display.pictures(&gpu, &uploaded, &uploaded.all(), cameras, &light());
    let [first, second] = [0, 1].map(|i| {
        let pixels = pictures.as_ref().unwrap()[i].pixels.cells().iter();
        pixels
            .map(|pixel| over_background(*pixel))
            .collect::<Vec<_>>()
    });
    assert_ne!(first, second);
    let mut canvases = [0, 0].map(|i| canvas(&gpu, &display, &uploaded, &cameras[i]));
    let draws = uploaded.all();
    let again = canvases[1].draw(&gpu, &display, &uploaded, &draws, &cameras[1], &light());
    again.unwrap();

    let seen = |how| compared(&gpu, canvases.each_ref(), how);
    assert_eq!(seen(Compared::First).cells(), first);
    assert_eq!(seen(Compared::Second).cells(), second);
    let split = seen(Compared::Split { border: 40 });
    let difference = seen(Compared::Difference { gain: 3.0 });
    for i in 0..first.len() {
        let expected = match (i % 96).cmp(&40) {
            std::cmp::Ordering::Less => first[i],
            std::cmp::Ordering::Equal => [255; 4],
            std::cmp::Ordering::Greater => second[i],
        };
        assert_eq!(split.cells()[i], expected);
        let apart = |c: usize| first[i][c].abs_diff(second[i][c]).saturating_mul(3);
        assert_eq!(difference.cells()[i], [apart(0), apart(1), apart(2), 255]);
    }
}

/// Each picture that was timed tells its time once, without anybody waiting for it.
#[test]
fn canvases_tell_times() {
    let Some(gpu) = gpu() else { return };
    let scene = farfield_town::house(1);
    let uploaded = GpuScene::new(&gpu, &scene).unwrap();
    let display = Display::new(&gpu, Canvas::FORMAT).unwrap();
    let camera = cameras(&scene, 64)[0];
    let mut canvas = canvas(&gpu, &display, &uploaded, &camera);
    for _ in 0..2 {
        let draws = uploaded.all();
        let drawn = canvas.draw(&gpu, &display, &uploaded, &draws, &camera, &light());
        drawn.unwrap();
        // Waits.
        compared(&gpu, [&canvas, &canvas], Compared::First);
        let time = canvas.gpu_milliseconds(&gpu).unwrap();
        assert_eq!(time.is_some(), canvas.is_timed());
        assert!(time.is_none_or(|time| time > 0.0), "{time:?}");
        assert_eq!(canvas.gpu_milliseconds(&gpu).unwrap(), None);
    }
}

#[test]
fn canvases_too_large_name_the_limit() {
    let Some(gpu) = gpu() else { return };
    let limit = gpu.device().limits().max_texture_dimension_2d;
    let refused = [
        Canvas::new(&gpu, [limit + 1, 1]).unwrap_err(),
        Comparison::target(&gpu, [1, limit + 1]).unwrap_err(),
    ];
    for error in refused {
        let is_limit = matches!(&error, GpuError::TooLarge { limit, .. } if *limit == "max_texture_dimension_2d");
        assert!(is_limit, "{error}");
    }
}
