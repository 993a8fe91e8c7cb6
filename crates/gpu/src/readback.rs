//! What was drawn, back from the GPU: many textures with one wait.

use crate::{Gpu, GpuError};
use farfield_views::Camera;
use std::ops::Range;
use std::sync::mpsc;
use wgpu::{Buffer, BufferUsages, CommandEncoder, Texture};

/// Pictures are drawn and read back in batches of at most so many bytes.
const BATCH: u64 = 128 << 20;

/// Runs of cameras whose pictures are read back together, with their bytes; a camera whose picture
/// is larger than that comes alone.
pub(crate) fn batches(
    cameras: &[Camera],
    bytes: impl Fn(&Camera) -> u64,
) -> impl Iterator<Item = (&[Camera], u64)> {
    let mut rest = cameras;
    std::iter::from_fn(move || {
        let mut total = bytes(rest.first()?);
        let mut count = 1;
        while let Some(next) = rest.get(count)
            && total + bytes(next) <= BATCH
        {
            total += bytes(next);
            count += 1;
        }
        let (batch, others) = rest.split_at(count);
        rest = others;
        Some((batch, total))
    })
}

/// A place for textures in the memory that both sides see.
#[derive(Debug)]
pub(crate) struct Readback {
    buffer: Buffer,
    used: u64,
}

/// Where a texture lies in it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slot {
    offset: u64,
    row: u64,
    padded_row: u64,
    rows: u64,
}

/// Bytes that a texture takes.
pub(crate) fn bytes_of(size: [u32; 2], bytes_per_texel: u32) -> u64 {
    u64::from(padded(size[0] * bytes_per_texel)) * u64::from(size[1])
}

fn padded(row: u32) -> u32 {
    row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT)
}

impl Readback {
    pub(crate) fn new(gpu: &Gpu, bytes: u64) -> Result<Self, GpuError> {
        let what = || "the size of a picture in bytes".to_owned();
        gpu.check_limit(what, bytes, "max_buffer_size", |limits| {
            limits.max_buffer_size
        })?;
        let buffer = gpu.device().create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: bytes,
            usage: BufferUsages::COPY_DST | BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        Ok(Self { buffer, used: 0 })
    }

    /// Copies a texture as it will be after what was encoded before.
    pub(crate) fn take(&mut self, encoder: &mut CommandEncoder, texture: &Texture) -> Slot {
        let texel = texture.format().block_copy_size(None);
        let texel = texel.expect("targets have texels of one size");
        let row = texture.width() * texel;
        let slot = Slot {
            offset: self.used,
            row: row.into(),
            padded_row: padded(row).into(),
            rows: texture.height().into(),
        };
        self.used += bytes_of([texture.width(), texture.height()], texel);
        let target = wgpu::TexelCopyBufferInfo {
            buffer: &self.buffer,
            layout: wgpu::TexelCopyBufferLayout {
                offset: slot.offset,
                bytes_per_row: Some(padded(row)),
                rows_per_image: None,
            },
        };
        encoder.copy_texture_to_buffer(texture.as_image_copy(), target, texture.size());
        slot
    }

    /// Copies what queries tell.
    pub(crate) fn take_buffer(&mut self, encoder: &mut CommandEncoder, source: &Buffer) -> Slot {
        self.take_bytes(encoder, source, 0..source.size())
    }

    /// Copies some bytes of a buffer.
    pub(crate) fn take_bytes(
        &mut self,
        encoder: &mut CommandEncoder,
        source: &Buffer,
        bytes: Range<u64>,
    ) -> Slot {
        let length = bytes.end - bytes.start;
        let slot = Slot {
            offset: self.used,
            row: length,
            padded_row: length,
            rows: 1,
        };
        encoder.copy_buffer_to_buffer(source, bytes.start, &self.buffer, self.used, length);
        self.used += length.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT.into());
        slot
    }

    /// Waits for all that was submitted and reads it.
    pub(crate) fn read(&self, gpu: &Gpu) -> Result<Mapped, GpuError> {
        let (sender, receiver) = mpsc::channel();
        let slice = self.buffer.slice(..);
        slice.map_async(wgpu::MapMode::Read, move |result| {
            // Nobody waits for it where waiting failed.
            let _ = sender.send(result);
        });
        gpu.wait()?;
        let failed = |reason: String| GpuError::Failed { reason };
        let mapped = receiver
            .try_recv()
            .map_err(|error| failed(error.to_string()))?;
        mapped.map_err(|error| failed(error.to_string()))?;
        let bytes = slice.get_mapped_range();
        let bytes = bytes.map_err(|error| failed(error.to_string()))?;
        Ok(Mapped { bytes })
    }
}

/// What was read.
#[derive(Debug)]
pub(crate) struct Mapped {
    bytes: wgpu::BufferView,
}

impl Mapped {
    /// What lies in a slot of one row.
    pub(crate) fn bytes(&self, slot: Slot) -> &[u8] {
        &self.bytes[slot.offset as usize..][..slot.row as usize]
    }

    /// The rows of a texture.
    pub(crate) fn rows(&self, slot: Slot) -> impl Iterator<Item = &[u8]> {
        let bytes = &self.bytes[slot.offset as usize..];
        let rows = bytes.chunks(slot.padded_row as usize);
        rows.take(slot.rows as usize)
            .map(move |row| &row[..slot.row as usize])
    }
}
