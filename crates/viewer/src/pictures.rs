//! Both sides drawn on the GPU, and what is made of the two: the same for the window and for screenshots.

use crate::flight::Flight;
use crate::stopwatch::Stopwatch;
use anyhow::{Context, Result};
use farfield_gpu::wgpu::Texture;
use farfield_gpu::{
    Canvas, Compared, Comparison, Display, Draws, Gpu, GpuError, GpuScene, Lighting,
};
use farfield_grid::Grid;
use farfield_scene::Scene;
use xtask::{Shown, ViewMode};

/// One of the two that are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Side {
    Original,
    Impostor,
}

impl Side {
    pub(crate) const ALL: [Self; 2] = [Self::Original, Self::Impostor];
}

/// How the two are compared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Look {
    pub(crate) mode: ViewMode,
    /// Where the border of the split is, as a share of the picture's width.
    pub(crate) split: f64,
    /// How much differences are amplified.
    pub(crate) gain: f32,
    /// Which side flickering shows now.
    pub(crate) flickers: Side,
}

impl Look {
    /// As the web page begins.
    pub(crate) fn new(mode: ViewMode) -> Self {
        Self {
            mode,
            split: 0.5,
            gain: 4.0,
            flickers: Side::Original,
        }
    }

    /// Whether a side is to be drawn.
    pub(crate) fn shows(&self, side: Side) -> bool {
        match self.mode {
            ViewMode::Original => side == Side::Original,
            ViewMode::Impostor => side == Side::Impostor,
            ViewMode::Flicker => side == self.flickers,
            ViewMode::Split | ViewMode::Difference => true,
        }
    }

    fn compared(&self, width: u32) -> Compared {
        match self.mode {
            ViewMode::Split => Compared::Split {
                border: (self.split * f64::from(width)).round() as u32,
            },
            ViewMode::Difference => Compared::Difference { gain: self.gain },
            ViewMode::Original | ViewMode::Impostor | ViewMode::Flicker => {
                match self.shows(Side::Original) {
                    true => Compared::First,
                    false => Compared::Second,
                }
            }
        }
    }
}

/// What was drawn of a side.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Drawn {
    pub(crate) triangles: u64,
    pub(crate) calls: usize,
}

/// A side on the GPU.
#[derive(Debug)]
struct Uploaded {
    scene: GpuScene,
    canvas: Canvas,
    stopwatch: Stopwatch,
    drawn: Option<Drawn>,
    /// Whether the viewer moved since it was drawn.
    is_stale: bool,
}

impl Uploaded {
    fn new(gpu: &Gpu, scene: &Scene, size: [u32; 2]) -> Result<Self, GpuError> {
        Ok(Self {
            scene: GpuScene::new(gpu, scene)?,
            canvas: Canvas::new(gpu, size)?,
            stopwatch: Stopwatch::default(),
            drawn: None,
            is_stale: true,
        })
    }
}

/// Both sides on the GPU, each uploaded once.
#[derive(Debug)]
pub(crate) struct Pictures {
    gpu: Gpu,
    display: Display,
    comparison: Comparison,
    /// None where it is not there.
    original: Option<Uploaded>,
    impostor: Uploaded,
    light: Lighting,
    target: Texture,
}

impl Pictures {
    /// Uploads both sides.
    ///
    /// * `size` - of the pictures, in pixels
    ///
    /// # Errors
    ///
    /// When something is larger than the device takes, its memory does not suffice, or it was lost.
    pub(crate) fn new(gpu: Gpu, shown: &Shown, size: [u32; 2]) -> Result<Self> {
        let upload = |what: &'static str, scene: &Scene| {
            Uploaded::new(&gpu, scene, size).with_context(|| format!("the {what} cannot be shown"))
        };
        let original = shown.original.as_ref();
        Ok(Self {
            original: original
                .map(|scene| upload("original", scene))
                .transpose()?,
            impostor: upload("impostor", &shown.impostor)?,
            display: Display::new(&gpu, Canvas::FORMAT)?,
            comparison: Comparison::new(&gpu)?,
            light: Lighting {
                to_sun: shown.light.to_sun,
                sun: shown.light.sun,
                sky: shown.light.sky,
                ground: shown.light.ground,
            },
            target: Comparison::target(&gpu, size)?,
            gpu,
        })
    }

    /// What is drawn to.
    pub(crate) fn target(&self) -> &Texture {
        &self.target
    }

    /// Of the pictures, in pixels.
    pub(crate) fn size(&self) -> [u32; 2] {
        [self.target.width(), self.target.height()]
    }

    /// Makes the pictures another size; then there is another target.
    ///
    /// # Errors
    ///
    /// As for [`Self::new`].
    pub(crate) fn resize(&mut self, size: [u32; 2]) -> Result<(), GpuError> {
        for uploaded in self.original.iter_mut().chain([&mut self.impostor]) {
            uploaded.canvas = Canvas::new(&self.gpu, size)?;
            uploaded.stopwatch = Stopwatch::default();
        }
        self.target = Comparison::target(&self.gpu, size)?;
        self.touch();
        Ok(())
    }

    /// The viewer moved: both sides are to be drawn again when they are shown.
    pub(crate) fn touch(&mut self) {
        for uploaded in self.original.iter_mut().chain([&mut self.impostor]) {
            uploaded.is_stale = true;
        }
    }

    /// Draws the sides that are shown, those that were not drawn since the viewer moved, and what is made
    /// of them. Does not wait.
    ///
    /// # Errors
    ///
    /// When the device's memory does not suffice, or it was lost.
    pub(crate) fn draw(
        &mut self,
        shown: &Shown,
        flight: &Flight,
        look: &Look,
    ) -> Result<(), GpuError> {
        let size = self.size();
        let camera = flight.camera(shown.manifest.options.fov_degrees.to_radians(), size);
        let Self {
            gpu,
            display,
            light,
            original,
            impostor,
            ..
        } = self;
        let draw = |uploaded: &mut Uploaded, draws: &Draws| {
            uploaded.is_stale = false;
            uploaded.drawn = Some(Drawn {
                triangles: draws.triangles(),
                calls: draws.count(),
            });
            let Uploaded { scene, canvas, .. } = uploaded;
            canvas.draw(gpu, display, scene, draws, &camera, light)
        };
        if let Some(original) = original
            && original.is_stale
            && look.shows(Side::Original)
        {
            draw(original, &original.scene.all())?;
        }
        if impostor.is_stale && look.shows(Side::Impostor) {
            // On borders between two sides, the one that the viewpoint is for.
            let alone = shown.shown_alone(flight.eye);
            let alone = alone.map(|alone| flight.at.map_or(alone, |sight| sight.impostor));
            let draws = match shown.drawn_from(flight.eye, alone) {
                Some(ranges) => impostor.scene.restricted(&ranges),
                None => impostor.scene.all(),
            };
            draw(impostor, &draws)?;
        }
        let second = &self.impostor.canvas;
        let first = self.original.as_ref().map_or(second, |side| &side.canvas);
        let compared = look.compared(size[0]);
        (self.comparison).draw(
            &self.gpu,
            [first, second],
            compared,
            shown.background,
            &self.target,
        )
    }

    /// The picture, once it is drawn: RGBA in sRGB, opaque.
    ///
    /// # Errors
    ///
    /// When the device was lost.
    pub(crate) fn read(&self) -> Result<Grid<[u8; 4]>, GpuError> {
        Comparison::read(&self.gpu, &self.target)
    }

    /// Takes the times that are known by now.
    ///
    /// # Errors
    ///
    /// When the device was lost.
    pub(crate) fn collect_times(&mut self) -> Result<(), GpuError> {
        for uploaded in self.original.iter_mut().chain([&mut self.impostor]) {
            if let Some(time) = uploaded.canvas.gpu_milliseconds(&self.gpu)? {
                uploaded.stopwatch.add(time);
            }
        }
        Ok(())
    }

    /// Whether a side's time is not known yet, but will be if it is drawn again.
    pub(crate) fn lacks_time(&self, side: Side) -> bool {
        let lacks =
            |one: &Uploaded| one.canvas.is_timed() && one.stopwatch.milliseconds().is_none();
        self.side(side).is_some_and(lacks)
    }

    /// Draws a side again although nothing changed, to know its time.
    pub(crate) fn touch_side(&mut self, side: Side) {
        let uploaded = match side {
            Side::Original => self.original.as_mut(),
            Side::Impostor => Some(&mut self.impostor),
        };
        if let Some(uploaded) = uploaded {
            uploaded.is_stale = true;
        }
    }

    /// What was drawn of a side last; `None` where nothing was.
    pub(crate) fn drawn(&self, side: Side) -> Option<Drawn> {
        self.side(side)?.drawn
    }

    /// The GPU's milliseconds for a picture of a side, as the median of some; `None` where they are not
    /// known.
    pub(crate) fn milliseconds(&self, side: Side) -> Option<f64> {
        self.side(side)?.stopwatch.milliseconds()
    }

    /// The GPU.
    pub(crate) fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    fn side(&self, side: Side) -> Option<&Uploaded> {
        match side {
            Side::Original => self.original.as_ref(),
            Side::Impostor => Some(&self.impostor),
        }
    }
}
