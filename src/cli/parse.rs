//! Values of arguments: how they are written, and what is said of those that are not.

use planisphere_renderer::{Device, MAX_SIDE, Region};

/// A count such as 1000000 or 1e6.
pub(super) fn parse_count(text: &str) -> Result<usize, String> {
    let fix = || "write a number of spheres, such as 1e6".to_string();
    let value: f64 = text.parse().map_err(|_| fix())?;
    if value >= 0.0 && value.fract() == 0.0 && value <= f64::from(i32::MAX) {
        Ok(value as usize)
    } else {
        Err(fix())
    }
}

/// A count of at least one sphere.
pub(super) fn parse_some(text: &str) -> Result<u32, String> {
    match parse_count(text)? {
        0 => Err("write a number of spheres from 1 on, such as 1e6".into()),
        count => Ok(count as u32),
    }
}

pub(super) fn parse_size(text: &str) -> Result<[u32; 2], String> {
    let fix = || format!("write width x height in pixels, each 1 to {MAX_SIDE}, such as 1920x1080");
    let (width, height) = text.split_once(['x', 'X']).ok_or_else(fix)?;
    let side =
        |text: &str| text.parse().ok().filter(|side| (1..=MAX_SIDE).contains(side)).ok_or_else(fix);
    Ok([side(width)?, side(height)?])
}

pub(super) fn parse_region(text: &str) -> Result<Region, String> {
    let fix = || "write column,row,width,height in pixels, such as 0,0,640,480".to_string();
    let numbers: Option<Vec<u32>> = text.split(',').map(|part| part.trim().parse().ok()).collect();
    match numbers.as_deref() {
        Some(&[x, y, width, height]) if width > 0 && height > 0 => {
            Ok(Region { x, y, width, height })
        }
        _ => Err(fix()),
    }
}

pub(super) fn parse_device(text: &str) -> Result<Device, &'static str> {
    text.parse()
}

#[cfg(feature = "bench")]
pub(super) fn parse_repetitions(text: &str) -> Result<usize, String> {
    text.parse()
        .ok()
        .filter(|n| (1..=1000).contains(n))
        .ok_or_else(|| "write a whole number from 1 to 1000".into())
}
