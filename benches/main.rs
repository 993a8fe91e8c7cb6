//! Benchmarks and the papers' tables.
//!
//! `cargo bench -p farfield-benches` measures the stages of a bake and prints the tables;
//! `cargo bench -p farfield-benches -- tables` prints the tables only.
#![expect(clippy::print_stdout, reason = "tables are printed")]

mod atlas;
mod models;
mod quads;
mod stages;

use criterion::Criterion;

fn main() {
    let models = models::layered();
    quads::table(&models::masks(&models));
    atlas::table(&models::padded_quads(&models));
    // Criterion reads the command line itself and refuses words it does not know.
    if std::env::args().any(|argument| argument == "tables") {
        return;
    }
    let mut criterion = Criterion::default().configure_from_args();
    stages::bench(&mut criterion, &models);
    criterion.final_summary();
}
