//! Benchmarks, the papers' tables, and a comparison with other representations.
//!
//! `cargo bench -p farfield-benches` measures the stages of a bake and prints the tables;
//! `cargo bench -p farfield-benches -- tables` prints the tables only, `-- compare` only the
//! comparison, `-- ratios` only how far the stages are from what bounds them, `-- growth` only how
//! time and memory of a bake grow with the scene, `-- bakes` only what whole bakes of real models take,
//! `-- passes` only what plain pictures take, for comparison with `benches/llvmpipe.py`.
//! `-- auto` tries and fits what `bake --technique auto` predicts, `-- tdm` prints the paper's table of
//! depth meshes, `-- simplify` what simplifying them costs, beside meshoptimizer,
//! `-- bitfields` the tables of ID-bitfields, `-- distances` those of samples at two distances,
//! `-- adaptive` what it takes until these miss nothing, of all models or, `-- adaptive NAME`, of one,
//! `-- culled` what they leave to draw beside other ways to draw less, `-- frames` what pictures of that
//! take, `-- cells` what view cells amid towns see.
//! Only `-- compare` takes all models, which is a matter of ten minutes: otherwise the comparison is
//! that of the built-in house. With `--pictures DIR` it writes what it compares into a folder.
#![expect(clippy::print_stdout, reason = "tables are printed")]

mod atlas;
mod auto;
mod bakes;
mod bitfields;
mod capture;
mod compare;
mod culled;
mod frames;
mod growth;
mod meshlets;
mod models;
mod numbered;
mod octahedral;
mod passes;
mod picture;
mod planar;
mod process;
mod quads;
mod ratios;
mod simplified;
mod simplify;
mod stages;
mod tdm;
mod view_cells;

use criterion::Criterion;
use models::Layered;
use std::path::PathBuf;

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let asked = |word: &str| arguments.iter().position(|argument| argument == word);
    let pictures = asked("--pictures").map(|at| {
        let folder = arguments.get(at + 1);
        PathBuf::from(folder.expect("--pictures is followed by a folder"))
    });
    let dense = || std::iter::once(models::house()).chain(models::read(&models::DENSE));
    let compare = |model| compare::table(&model, pictures.as_deref());
    if asked("compare").is_some() {
        let all = dense().chain(models::read(&models::CITY));
        return all.for_each(compare);
    }
    if asked("growth").is_some() {
        return growth::table();
    }
    if let Some(at) = asked(growth::ONE) {
        return growth::bake_one(arguments.get(at + 1).map_or("", String::as_str));
    }

    if asked("bakes").is_some() {
        return bakes::table();
    }
    if let Some(at) = asked(bakes::ONE) {
        return bakes::bake_one(arguments.get(at + 1).map_or("", String::as_str));
    }
    if asked("passes").is_some() {
        let models = dense().chain(models::read(&models::LARGE[..1]));
        return passes::table(&models.collect::<Vec<_>>());
    }

    if asked("auto").is_some() {
        return auto::tables();
    }
    if let Some(at) = asked("adaptive") {
        // Cargo adds --bench.
        let name = arguments.get(at + 1).filter(|name| !name.starts_with("--"));
        return bitfields::adaptive_tables(name.map_or("", String::as_str));
    }
    if asked("frames").is_some() {
        return frames::table();
    }
    if asked("culled").is_some() {
        return culled::table();
    }
    if asked("cells").is_some() {
        return view_cells::tables();
    }
    if let Some(at) = asked("patches") {
        // Cargo adds --bench.
        let name = arguments.get(at + 1).filter(|name| !name.starts_with("--"));
        return bitfields::patches_tables(name.map_or("", String::as_str));
    }
    if asked("distances").is_some() {
        return bitfields::distances_table();
    }
    if asked("bitfields").is_some() {
        return bitfields::tables();
    }
    if asked("tdm").is_some() {
        return tdm::tables();
    }
    if asked("simplify").is_some() {
        return simplify::table();
    }
    if asked("ratios").is_some() {
        let models = dense()
            .chain(models::read(&models::LARGE))
            .chain(models::read(&models::LEAVES));
        ratios::table(&models.map(models::prepare).collect::<Vec<_>>());
        return models::read(&models::DENSE[1..2])
            .iter()
            .for_each(ratios::growth);
    }

    let layered: Vec<Layered> = dense().map(models::prepare).collect();
    quads::table(&models::masks(&layered));
    atlas::table(&models::padded_quads(&layered));
    compare(models::house());
    // Criterion reads the command line itself and refuses words it does not know.
    if asked("tables").is_some() {
        return;
    }
    let mut criterion = Criterion::default().configure_from_args();
    stages::bench(&mut criterion, &layered);
    criterion.final_summary();
}
