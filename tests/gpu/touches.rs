//! What the GPU's search finds, as recording takes it.

use farfield_gpu::Touches;
use farfield_sampling::Touch;

/// The touches of a search, in its order.
pub(crate) fn of_search(found: &Touches) -> Vec<Touch> {
    let touches = found.list.iter().map(|touch| Touch {
        object: touch.object,
        triangle: touch.triangle,
        layer: touch.layer,
        y: touch.y,
        x: touch.x,
    });
    touches.collect()
}
