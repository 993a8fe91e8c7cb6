#![doc = include_str!("../README.md")]

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
mod noise;
mod textures;

pub use house::house;
