//! Files: text of a bounded size, and images as PNG.

use std::fs::File;
use std::io::{BufReader, ErrorKind, Read};
use std::path::Path;

use super::error::DatasetError;
use crate::image::Image;

/// Largest files and images that are read.
const TEXT_BYTES: u64 = 256 << 20;
const PNG_BYTES: u64 = 64 << 20;
const SIDE_PX: u32 = 8192;

fn open(path: &Path, limit: u64, by: Option<&str>) -> Result<File, DatasetError> {
    let failed = |source: std::io::Error| match source.kind() {
        ErrorKind::NotFound => DatasetError::Missing { path: path.into(), by: by.map(String::from) },
        _ => DatasetError::Io { path: path.into(), source },
    };
    let file = File::open(path).map_err(failed)?;
    let bytes = file.metadata().map_err(failed)?.len();
    if bytes > limit {
        return Err(DatasetError::TooLarge { path: path.into(), bytes, limit });
    }
    Ok(file)
}

/// The lines of a text file, numbered from 1, without empty ones and comments (`#`).
pub(crate) fn read_lines(path: &Path, by: Option<&str>) -> Result<Vec<(usize, String)>, DatasetError> {
    let mut text = String::new();
    let file = open(path, TEXT_BYTES, by)?;
    file.take(TEXT_BYTES)
        .read_to_string(&mut text)
        .map_err(|source| DatasetError::Io { path: path.into(), source })?;
    let lines = text.lines().enumerate().map(|(number, line)| (number + 1, line.trim()));
    let told = lines.filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
    Ok(told.map(|(number, line)| (number, line.to_string())).collect())
}

/// `count` finite numbers of a line.
pub(crate) fn numbers<const COUNT: usize>(
    path: &Path,
    line: usize,
    text: &str,
) -> Result<[f64; COUNT], DatasetError> {
    let bad = |what: String| DatasetError::BadLine { path: path.into(), line, what };
    let words: Vec<&str> = text.split_whitespace().collect();
    let Ok(words): Result<[&str; COUNT], _> = words.as_slice().try_into() else {
        return Err(bad(format!("{COUNT} numbers belong here, {} words were found", words.len())));
    };
    let mut numbers = [0.0; COUNT];
    for (number, word) in numbers.iter_mut().zip(words) {
        *number = word
            .parse()
            .ok()
            .filter(|x: &f64| x.is_finite())
            .ok_or_else(|| bad(format!("`{word}` is no number")))?;
    }
    Ok(numbers)
}

/// Writes a whole file.
pub(crate) fn write(path: &Path, bytes: &[u8]) -> Result<(), DatasetError> {
    std::fs::write(path, bytes).map_err(|source| DatasetError::Io { path: path.into(), source })
}

/// Makes a folder, and those it lies in.
pub(crate) fn make_folder(path: &Path) -> Result<(), DatasetError> {
    std::fs::create_dir_all(path).map_err(|source| DatasetError::Io { path: path.into(), source })
}

/// Writes an image as PNG of 8-bit sRGB.
pub fn write_png(path: &Path, image: &Image) -> Result<(), DatasetError> {
    let bytes = png_bytes(image).map_err(|why| DatasetError::BadImage { path: path.into(), why })?;
    write(path, &bytes)
}

/// An image as PNG of 8-bit sRGB; the error says why it is none.
pub fn png_bytes(image: &Image) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, image.width as u32, image.height as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header().map_err(|why| why.to_string())?;
    writer.write_image_data(&image.rgb).and_then(|()| writer.finish()).map_err(|why| why.to_string())?;
    Ok(bytes)
}

/// Reads a PNG of any kind as 8-bit colour: palettes are looked up, grey becomes three equal bytes, transparency is left out.
pub fn read_png(path: &Path) -> Result<Image, DatasetError> {
    read_png_for(path, None)
}

/// [`read_png`], with the name of what needs the file.
pub(crate) fn read_png_for(path: &Path, by: Option<&str>) -> Result<Image, DatasetError> {
    let bad = |why: String| DatasetError::BadImage { path: path.into(), why };
    let file = open(path, PNG_BYTES, by)?;
    let mut decoder = png::Decoder::new(BufReader::new(file));
    decoder.set_transformations(png::Transformations::normalize_to_color8());
    let mut reader = decoder.read_info().map_err(|error| bad(error.to_string()))?;
    let (width, height) = reader.info().size();
    if width.max(height) > SIDE_PX {
        return Err(bad(format!("its {width} × {height} pixels are more than {SIDE_PX} along a side")));
    }
    let size = reader.output_buffer_size().ok_or_else(|| bad("it is too large".into()))?;
    let mut bytes = vec![0; size];
    let info = reader.next_frame(&mut bytes).map_err(|error| bad(error.to_string()))?;
    bytes.truncate(info.buffer_size());
    let rgb = match info.color_type {
        png::ColorType::Rgb => bytes,
        png::ColorType::Rgba => pixels(&bytes, |&[r, g, b, _]: &[u8; 4]| [r, g, b]),
        png::ColorType::Grayscale => pixels(&bytes, |&[grey]: &[u8; 1]| [grey; 3]),
        png::ColorType::GrayscaleAlpha => pixels(&bytes, |&[grey, _]: &[u8; 2]| [grey; 3]),
        png::ColorType::Indexed => return Err(bad("its palette was not looked up".into())),
    };
    Ok(Image { width: width as usize, height: height as usize, rgb })
}

fn pixels<const CHANNELS: usize>(bytes: &[u8], colour: impl Fn(&[u8; CHANNELS]) -> [u8; 3]) -> Vec<u8> {
    bytes.as_chunks().0.iter().flat_map(colour).collect()
}
