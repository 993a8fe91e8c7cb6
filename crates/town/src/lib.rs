#![doc = include_str!("../README.md")]

mod town;

mod bank;
mod plan;
mod settle;
mod terrain;

mod part;

mod building;
mod castle;
mod church;
mod furniture;
mod housetop;
mod tree;

mod house;

mod chimneys;
mod facade;
mod portal;
mod roof;
mod turret;
mod windows;

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
