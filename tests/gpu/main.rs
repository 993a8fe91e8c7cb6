//! The GPU backend against the CPU's pictures, which are the reference.

mod adapter;
mod bakes;
mod comparison;
mod display;
mod errors;
mod ids;
mod layers;
mod setup;
mod touches;
