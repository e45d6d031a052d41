//! Colours as linear light, red, green, blue, 1 for white paper in good light.

pub(crate) type Rgb = [f32; 3];

pub(crate) const BLACK: Rgb = [0.0; 3];
pub(crate) const WHITE: Rgb = [1.0; 3];

pub(crate) fn times(a: Rgb, b: Rgb) -> Rgb {
    [a[0] * b[0], a[1] * b[1], a[2] * b[2]]
}

pub(crate) fn scaled(a: Rgb, by: f32) -> Rgb {
    [a[0] * by, a[1] * by, a[2] * by]
}

pub(crate) fn plus(a: Rgb, b: Rgb) -> Rgb {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// From `a` (0) to `b` (1).
pub(crate) fn mixed(a: Rgb, b: Rgb, share: f32) -> Rgb {
    std::array::from_fn(|i| a[i] + (b[i] - a[i]) * share)
}

/// Luma of linear light (Rec. 709).
pub(crate) fn luminance(a: Rgb) -> f32 {
    0.2126 * a[0] + 0.7152 * a[1] + 0.0722 * a[2]
}

/// A colour by hue (in turns), saturation and value, each 0 to 1.
pub(crate) fn hue(turn: f32, saturation: f32, value: f32) -> Rgb {
    let channel = |offset: f32| {
        let place = (turn + offset) * 6.0;
        let k = place - libm::floorf(place / 6.0) * 6.0;
        value * (1.0 - saturation * k.min(4.0 - k).clamp(0.0, 1.0))
    };
    [channel(5.0 / 6.0), channel(3.0 / 6.0), channel(1.0 / 6.0)]
}

/// 0 below `low`, 1 above `high`, smooth between.
pub(crate) fn ramp(low: f32, high: f32, x: f32) -> f32 {
    let share = ((x - low) / (high - low)).clamp(0.0, 1.0);
    share * share * (3.0 - 2.0 * share)
}

/// The lesser number in one instruction; `b` if one of them is NaN.
#[inline]
pub(crate) fn least(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// The greater number in one instruction; `b` if one of them is NaN.
#[inline]
pub(crate) fn greatest(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}
