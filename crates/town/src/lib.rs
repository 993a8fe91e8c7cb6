#![doc = include_str!("../README.md")]

mod town;

// Where everything is: the plan, the ground, what stands on it.
mod bank;
mod grove;
mod plan;
mod settle;
mod terrain;

// What stands in a town, each part one mesh.
mod part;

mod building;
mod castle;
mod church;
mod furniture;
mod housetop;
mod tree;

// The house, which is also the town's guildhall.
mod house;

mod chimneys;
mod facade;
mod portal;
mod roof;
mod turret;
mod windows;

// Surfaces and scenes.
mod assembly;
mod shape;
mod skin;

mod canvas;
mod dice;
mod names;
mod noise;
mod palette;
mod textures;

pub use house::house;
pub use town::{TOWN_TRIANGLES, town};
