//! STL, as text and binary. Normals are not read: the order of corners says which side is out.

use super::wrong;
use crate::content::imaging::Unread;
use crate::frame::Vec3;
use crate::volume::solid::Triangle;

/// Bytes before the count of a binary file's triangles, and of each triangle.
const HEAD: usize = 80;
const EACH: usize = 50;

pub(super) fn parse(bytes: &[u8]) -> Result<Vec<Triangle>, Unread> {
    let count = bytes.get(HEAD..).and_then(|rest| rest.first_chunk()).map(|word| u32::from_le_bytes(*word) as usize);
    let length = |count: usize| HEAD + 4 + EACH * count;
    let is_text = bytes.trim_ascii_start().starts_with(b"solid");
    match count {
        // Some binary files begin with "solid" too; their length gives them away.
        Some(count) if bytes.len() == length(count) => Ok(binary(&bytes[HEAD + 4..])),
        _ if is_text => text(bytes),
        Some(count) if bytes.len() > length(count) && bytes.len() - length(count) < EACH && count > 0 => {
            Ok(binary(&bytes[HEAD + 4..length(count)]))
        }
        Some(count) => Err(wrong(
            format!("it announces {count} triangles, which take {} bytes, and has {}", length(count), bytes.len()),
            "copy or export the file again",
        )),
        None => Err(wrong("this is no STL file", "export the surface again as STL")),
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

fn text(bytes: &[u8]) -> Result<Vec<Triangle>, Unread> {
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
            Some(_) => return Err(wrong(format!("line {number} is no line of an STL file"), again)),
        }
    }
    match is_ended && corners.is_empty() {
        true => Ok(triangles),
        false => Err(wrong("the file ends before its last facet, or before `endsolid`", again)),
    }
}
