//! The stages of a bake, one by one.

use crate::models::Layered;
use criterion::{Criterion, Throughput};
use farfield_atlas::pack;
use farfield_culling::Culler;
use farfield_quads::{Price, cover};
use farfield_sampling::{Foliage, LayerMasks, Textures, rasterize};
use std::hint::black_box;
use xtask::recording::{record_layers, recording_camera};

/// Measures each stage on each model; the bounds are triangles and texels touched, so throughput
/// is given in those.
pub(crate) fn bench(criterion: &mut Criterion, models: &[Layered]) {
    for model in models {
        let (scene, stack) = (&model.scene, &model.stack);
        let textures = Textures::new(scene);
        let recording = record_layers(scene, &textures, stack, &model.cell, Foliage::Any);

        let mut group = criterion.benchmark_group("sampling");
        group
            .sample_size(20)
            .throughput(Throughput::Elements(scene.drawn_triangles()));
        // Both through the same camera, so that their times can be compared.
        let camera = recording_camera(stack);
        group.bench_function(format!("rasterize/{}/512", model.name), |bencher| {
            bencher.iter(|| black_box(rasterize(scene, &textures, &camera)));
        });
        group.throughput(Throughput::Elements(recording.samples.len() as u64));
        group.bench_function(format!("record/{}/512", model.name), |bencher| {
            bencher.iter(|| {
                black_box(record_layers(
                    scene,
                    &textures,
                    stack,
                    &model.cell,
                    Foliage::Any,
                ))
            });
        });
        group.finish();

        let mut group = criterion.benchmark_group("culling");
        let texels = u64::from(stack.width) * u64::from(stack.height) * stack.layers.len() as u64;
        group
            .sample_size(20)
            .throughput(Throughput::Elements(texels));
        let masks: Vec<LayerMasks> = (0..stack.layers.len())
            .map(|layer| recording.masks(layer, stack.width, stack.height))
            .collect();
        group.bench_function(format!("cull/{}/512", model.name), |bencher| {
            bencher.iter(|| {
                let mut culler = Culler::new(stack.width as usize, stack.height as usize);
                for mask in &masks {
                    black_box(culler.next(&mask.opaque, &mask.occluding));
                }
            });
        });
        group.finish();

        let mut group = criterion.benchmark_group("quads");
        group
            .sample_size(20)
            .throughput(Throughput::Elements(texels));
        let grow = || {
            let rects = model
                .visible
                .iter()
                .flat_map(|mask| cover(mask, &Price::default()));
            rects.collect::<Vec<_>>()
        };
        group.bench_function(format!("cover/{}/512", model.name), |bencher| {
            bencher.iter(|| black_box(grow()));
        });
        group.finish();

        let sizes: Vec<[u32; 2]> = grow()
            .iter()
            .map(|rect| [rect.width + 2, rect.height + 2])
            .collect();
        let mut group = criterion.benchmark_group("atlas");
        group
            .sample_size(20)
            .throughput(Throughput::Elements(sizes.len() as u64));
        group.bench_function(format!("pack/{}/512", model.name), |bencher| {
            bencher.iter(|| black_box(pack(&sizes, 4096)));
        });
        group.finish();
    }
}
