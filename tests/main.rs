//! What needs two crates or more, and whole bakes.

mod bad_input;
mod bitfields;
mod borders;
mod channels;
mod damage;
mod damaged;
mod deadline;
mod determinism;
mod dump;
mod foliage;
mod good;
mod house;
mod import;
mod invariance;
mod models;
mod occlusion;
mod outliers;
mod sabotage;
mod setup;
mod shapes;
mod sides;
mod tdm;
mod town;
