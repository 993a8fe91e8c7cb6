#![doc = include_str!("../README.md")]

mod bitfield;

pub use bitfield::Bitfield;
