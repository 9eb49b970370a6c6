//! STL, as text and binary. Normals are not read: the order of the corners determines the outside.

use crate::imaging::ScanError;
use crate::surfaces::wrong;
use typodont_core::frame::Vec3;
use typodont_core::volume::solid::Triangle;

/// Bytes before the triangle count of a binary file, and bytes per triangle.
const HEAD: usize = 80;
const EACH: usize = 50;

pub(super) fn parse(bytes: &[u8]) -> Result<Vec<Triangle>, ScanError> {
    let count = bytes.get(HEAD..).and_then(|rest| rest.first_chunk()).map(|word| u32::from_le_bytes(*word));
    // Computed in 64 bits on every platform: a declared count can require more bytes than a 32-bit address space has.
    let length = |count: u32| (HEAD + 4) as u64 + EACH as u64 * u64::from(count);
    let size = bytes.len() as u64;
    let is_text = bytes.trim_ascii_start().starts_with(b"solid");
    match count {
        // Some binary files begin with "solid" too; they are recognized by their length.
        Some(count) if size == length(count) => Ok(binary(&bytes[HEAD + 4..])),
        _ if is_text => text(bytes),
        Some(count) if count > 0 && (length(count)..length(count) + EACH as u64).contains(&size) => {
            Ok(binary(&bytes[HEAD + 4..length(count) as usize]))
        }
        Some(count) => Err(wrong(
            format!("it declares {count} triangles, which take {} bytes, but has {size} bytes", length(count)),
            "copy or export the file again",
        )),
        None => Err(wrong("this is not an STL file", "export the surface again as STL")),
    }
}

fn binary(bytes: &[u8]) -> Vec<Triangle> {
    let corner = |at: &[u8]| {
        let (numbers, _) = at.as_chunks::<4>();
        Vec3::from([0, 1, 2].map(|n| f32::from_le_bytes(numbers[n])))
    };
    let (each, _) = bytes.as_chunks::<EACH>();
    each.iter().map(|t| [12, 24, 36].map(|at| corner(&t[at..at + 12]))).collect()
}

fn text(bytes: &[u8]) -> Result<Vec<Triangle>, ScanError> {
    let again = "copy or export the file again";
    let mut triangles = Vec::new();
    let mut corners: Vec<Vec3> = Vec::new();
    let mut is_ended = false;
    for (number, line) in (1..).zip(bytes.split(|&b| b == b'\n')) {
        let line = String::from_utf8_lossy(line);
        let mut words = line.split_ascii_whitespace();
        match words.next().map(str::to_ascii_lowercase).as_deref() {
            Some("vertex") => {
                let numbers: Option<Vec<f32>> = words.map(|word| word.parse().ok()).collect();
                let place: Option<[f32; 3]> = numbers.and_then(|numbers| numbers.try_into().ok());
                corners.push(
                    place
                        .map(Vec3::from)
                        .ok_or_else(|| wrong(format!("line {number}: a corner is not three numbers"), again))?,
                );
            }
            Some("endfacet") => {
                let triangle = <[Vec3; 3]>::try_from(std::mem::take(&mut corners)).map_err(|corners| {
                    wrong(format!("line {number}: a facet has {} corners, not three", corners.len()), again)
                })?;
                triangles.push(triangle);
            }
            Some("endsolid") => is_ended = true,
            Some("solid" | "facet" | "outer" | "endloop") | None => {}
            Some(_) => return Err(wrong(format!("line {number} is not a line of an STL file"), again)),
        }
    }
    match is_ended && corners.is_empty() {
        true => Ok(triangles),
        false => Err(wrong("the file ends before its last facet, or before `endsolid`", again)),
    }
}
