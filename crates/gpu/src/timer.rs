//! How long passes take, told at once or some frames later.

use crate::{Gpu, GpuError};
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};
use wgpu::{Buffer, BufferUsages, CommandEncoder, QuerySet};

/// Two times of 8 bytes.
const BYTES: u64 = 16;

/// Tells when something begins and when something ends.
#[derive(Debug)]
pub(crate) struct Clock {
    queries: QuerySet,
    times: Buffer,
}

impl Clock {
    pub(crate) fn new(gpu: &Gpu) -> Self {
        Self {
            queries: gpu.device().create_query_set(&wgpu::QuerySetDescriptor {
                label: None,
                ty: wgpu::QueryType::Timestamp,
                count: 2,
            }),
            times: buffer(gpu, BufferUsages::QUERY_RESOLVE | BufferUsages::COPY_SRC),
        }
    }

    /// For passes to write a beginning and an end to.
    pub(crate) fn queries(&self) -> &QuerySet {
        &self.queries
    }

    /// The times of what was encoded, to be read back for [`milliseconds`].
    pub(crate) fn take(&self, encoder: &mut CommandEncoder) -> &Buffer {
        encoder.resolve_query_set(&self.queries, 0..2, &self.times, 0);
        &self.times
    }
}

/// Times passes, one at a time, and does not wait for them.
#[derive(Debug)]
pub(crate) struct Timer {
    clock: Clock,
    read: Buffer,
    /// What the driver was asked for and is done with.
    state: Arc<AtomicU8>,
}

const FREE: u8 = 0;
const ASKED: u8 = 1;
const ANSWERED: u8 = 2;
const FAILED: u8 = 3;

impl Timer {
    pub(crate) fn new(gpu: &Gpu) -> Self {
        Self {
            clock: Clock::new(gpu),
            read: buffer(gpu, BufferUsages::COPY_DST | BufferUsages::MAP_READ),
            state: Arc::new(AtomicU8::new(FREE)),
        }
    }

    /// Whether another pass can be timed.
    pub(crate) fn is_free(&self) -> bool {
        self.state.load(Ordering::Acquire) == FREE
    }

    /// For the pass to write its beginning and end to.
    pub(crate) fn queries(&self) -> &QuerySet {
        self.clock.queries()
    }

    /// Takes the times of the pass that was encoded.
    pub(crate) fn take(&self, encoder: &mut CommandEncoder) {
        let times = self.clock.take(encoder);
        encoder.copy_buffer_to_buffer(times, 0, &self.read, 0, BYTES);
    }

    /// Asks for the times, once the pass was submitted.
    pub(crate) fn ask(&self) {
        self.state.store(ASKED, Ordering::Release);
        let state = Arc::clone(&self.state);
        self.read
            .slice(..)
            .map_async(wgpu::MapMode::Read, move |result| {
                let answer = if result.is_ok() { ANSWERED } else { FAILED };
                state.store(answer, Ordering::Release);
            });
    }

    /// Milliseconds that the pass took, if they are known by now; then another one can be timed.
    pub(crate) fn answer(&mut self, gpu: &Gpu) -> Result<Option<f64>, GpuError> {
        let failed = |reason: String| GpuError::Failed { reason };
        let polled = gpu.device().poll(wgpu::PollType::Poll);
        polled.map_err(|error| failed(error.to_string()))?;
        match self.state.load(Ordering::Acquire) {
            ANSWERED => {}
            FAILED => return Err(failed("times cannot be read back".into())),
            _ => return Ok(None),
        }
        let bytes = self.read.slice(..).get_mapped_range();
        let bytes = bytes.map_err(|error| failed(error.to_string()))?;
        let milliseconds = milliseconds(gpu, &bytes);
        drop(bytes);
        self.read.unmap();
        self.state.store(FREE, Ordering::Release);
        Ok(Some(milliseconds))
    }
}

fn buffer(gpu: &Gpu, usage: BufferUsages) -> Buffer {
    gpu.device().create_buffer(&wgpu::BufferDescriptor {
        label: Some("times"),
        size: BYTES,
        usage,
        mapped_at_creation: false,
    })
}

/// From the first to the second of two timestamps.
pub(crate) fn milliseconds(gpu: &Gpu, times: &[u8]) -> f64 {
    let times: Vec<u64> = bytemuck::pod_collect_to_vec(times);
    let period = f64::from(gpu.queue().get_timestamp_period());
    times[1].saturating_sub(times[0]) as f64 * period / 1e6
}
