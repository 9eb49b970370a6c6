//! Small scans in each format, made here to be read, varied and broken.

#![allow(dead_code)]

use flate2::Compression;
use flate2::write::{GzEncoder, ZlibEncoder};
use std::io::Write;
use std::path::{Path, PathBuf};

pub fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

pub fn zlib(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

/// A NIfTI-1 file of 4×3×2 voxels, little endian.
#[derive(Clone)]
pub struct Nifti {
    pub header: Vec<u8>,
    pub data: Vec<u8>,
}

impl Nifti {
    /// uint8, 0 to 23; `sform`: x runs left at 0.5, y forward at 0.25, z up at 2, the first voxel at (−1, −2, 3).
    pub fn good() -> Nifti {
        let mut nifti = Nifti { header: vec![0; 352], data: (0..24).collect() };
        nifti.header[0..4].copy_from_slice(&348i32.to_le_bytes());
        for (n, dim) in [3i16, 4, 3, 2, 1, 1, 1, 1].into_iter().enumerate() {
            nifti.short(40 + 2 * n, dim);
        }
        nifti.short(70, 2);
        nifti.short(72, 8);
        for (n, size) in [1.0f32, 0.5, 0.25, 2.0].into_iter().enumerate() {
            nifti.float(76 + 4 * n, size);
        }
        nifti.float(108, 352.0);
        nifti.float(112, 1.0);
        nifti.header[123] = 2;
        nifti.short(254, 1);
        let rows = [[-0.5f32, 0.0, 0.0, -1.0], [0.0, 0.25, 0.0, -2.0], [0.0, 0.0, 2.0, 3.0]];
        for (r, row) in rows.into_iter().enumerate() {
            row.into_iter().enumerate().for_each(|(c, v)| nifti.float(280 + 16 * r + 4 * c, v));
        }
        nifti.header[344..348].copy_from_slice(b"n+1\0");
        nifti
    }

    pub fn short(&mut self, at: usize, value: i16) {
        self.header[at..at + 2].copy_from_slice(&value.to_le_bytes());
    }

    pub fn float(&mut self, at: usize, value: f32) {
        self.header[at..at + 4].copy_from_slice(&value.to_le_bytes());
    }

    pub fn bytes(&self) -> Vec<u8> {
        [&self.header[..], &self.data].concat()
    }
}

/// A MetaImage header of 4×3×2 voxels of 0.5×0.25×2 mm, and what follows it.
pub fn meta_image(lines: &[&str], data: &[u8]) -> Vec<u8> {
    let mut known: Vec<String> = [
        "ObjectType = Image",
        "NDims = 3",
        "BinaryData = True",
        "BinaryDataByteOrderMSB = False",
        "CompressedData = False",
        "TransformMatrix = 1 0 0 0 1 0 0 0 1",
        "Offset = 1 2 3",
        "AnatomicalOrientation = RAI",
        "ElementSpacing = 0.5 0.25 2",
        "DimSize = 4 3 2",
        "ElementType = MET_UCHAR",
        "ElementDataFile = LOCAL",
    ]
    .map(str::to_string)
    .to_vec();
    for line in lines {
        let key = line.split('=').next().unwrap().trim();
        let last = known.len() - 1;
        match known.iter_mut().find(|k| k.split('=').next().unwrap().trim() == key) {
            Some(k) => *k = line.to_string(),
            None => known.insert(last, line.to_string()),
        }
    }
    let mut bytes = known.iter().map(|line| format!("{line}\n")).collect::<String>().into_bytes();
    bytes.extend_from_slice(data);
    bytes
}

/// One CT slice, to be varied.
#[derive(Clone)]
pub struct Slice {
    pub syntax: &'static str,
    pub series: &'static str,
    pub position: [f64; 3],
    pub orientation: [f64; 6],
    pub spacing: [f64; 2],
    pub columns: u16,
    pub rows: u16,
    pub number: u16,
    pub bits: u16,
    pub is_signed: bool,
    pub slope: &'static str,
    pub intercept: &'static str,
    pub photometric: &'static str,
    pub pixels: Vec<u16>,
    /// Compressed pixels in the place of plain ones.
    pub fragments: Option<Vec<Vec<u8>>>,
    pub frames: Option<&'static str>,
}

pub const EXPLICIT: &str = "1.2.840.10008.1.2.1";
pub const IMPLICIT: &str = "1.2.840.10008.1.2";
pub const BIG: &str = "1.2.840.10008.1.2.2";

impl Slice {
    /// 5×4 pixels, 0.3 mm apart along rows and 0.4 mm between them, at a height, mm. Stored numbers rise by one.
    pub fn at(z: f64, first: u16) -> Slice {
        Slice {
            syntax: EXPLICIT,
            series: "1.2.3.4.5",
            position: [-10.0, 20.0, z],
            orientation: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0],
            spacing: [0.4, 0.3],
            columns: 5,
            rows: 4,
            number: 1,
            bits: 12,
            is_signed: false,
            slope: "1",
            intercept: "-1024",
            photometric: "MONOCHROME2",
            pixels: (first..first + 20).collect(),
            fragments: None,
            frames: None,
        }
    }

    pub fn write(&self, path: &Path) {
        std::fs::write(path, self.bytes()).unwrap();
    }

    /// The file, element by element (DICOM PS3.5 and PS3.10).
    pub fn bytes(&self) -> Vec<u8> {
        let joined = |values: &[f64]| values.iter().map(f64::to_string).collect::<Vec<_>>().join("\\");
        let mut meta = Elements { bytes: Vec::new(), is_explicit: true, is_big: false };
        meta.text(0x0002_0002, b"UI", "1.2.840.10008.5.1.4.1.1.2");
        meta.text(0x0002_0010, b"UI", self.syntax);
        let mut body = Elements { bytes: Vec::new(), is_explicit: self.syntax != IMPLICIT, is_big: self.syntax == BIG };
        body.text(0x0008_0016, b"UI", "1.2.840.10008.5.1.4.1.1.2");
        body.text(0x0008_0060, b"CS", "CT");
        body.text(0x0008_103E, b"LO", "Jaw");
        body.sequence(0x0008_1140);
        body.text(0x0020_000E, b"UI", self.series);
        body.text(0x0020_0011, b"IS", self.series.rsplit('.').next().unwrap());
        body.text(0x0020_0013, b"IS", &self.number.to_string());
        body.text(0x0020_0032, b"DS", &joined(&self.position));
        body.text(0x0020_0037, b"DS", &joined(&self.orientation));
        body.short(0x0028_0002, 1);
        body.text(0x0028_0004, b"CS", self.photometric);
        if let Some(frames) = self.frames {
            body.text(0x0028_0008, b"IS", frames);
        }
        body.short(0x0028_0010, self.rows);
        body.short(0x0028_0011, self.columns);
        body.text(0x0028_0030, b"DS", &joined(&self.spacing));
        body.short(0x0028_0100, 16);
        body.short(0x0028_0101, self.bits);
        body.short(0x0028_0102, self.bits - 1);
        body.short(0x0028_0103, self.is_signed.into());
        body.text(0x0028_1052, b"DS", self.intercept);
        body.text(0x0028_1053, b"DS", self.slope);
        match &self.fragments {
            None => {
                let pixels: Vec<u8> = self.pixels.iter().flat_map(|&pixel| body.pair(pixel)).collect();
                body.element(0x7FE0_0010, b"OW", &pixels);
            }
            Some(fragments) => {
                body.head(0x7FE0_0010, b"OB", u32::MAX);
                // The table of offsets, which may be empty.
                body.item(&[]);
                fragments.iter().for_each(|fragment| body.item(fragment));
                body.tag(0xFFFE_E0DD);
                body.bytes.extend([0; 4]);
            }
        }
        let mut file = vec![0; 128];
        file.extend(b"DICM");
        let mut length = Elements { bytes: Vec::new(), is_explicit: true, is_big: false };
        length.element(0x0002_0000, b"UL", &(meta.bytes.len() as u32).to_le_bytes());
        [file, length.bytes, meta.bytes, body.bytes].concat()
    }
}

struct Elements {
    bytes: Vec<u8>,
    is_explicit: bool,
    is_big: bool,
}

impl Elements {
    fn pair(&self, value: u16) -> [u8; 2] {
        if self.is_big { value.to_be_bytes() } else { value.to_le_bytes() }
    }

    fn long(&mut self, value: u32) {
        self.bytes.extend(if self.is_big { value.to_be_bytes() } else { value.to_le_bytes() });
    }

    fn tag(&mut self, tag: u32) {
        let (group, element) = (self.pair((tag >> 16) as u16), self.pair(tag as u16));
        self.bytes.extend([group, element].concat());
    }

    fn head(&mut self, tag: u32, vr: &[u8; 2], length: u32) {
        self.tag(tag);
        match (self.is_explicit, vr) {
            (false, _) => self.long(length),
            (true, b"OB" | b"OW" | b"SQ") => {
                self.bytes.extend([vr[0], vr[1], 0, 0]);
                self.long(length);
            }
            (true, _) => {
                let length = self.pair(length as u16);
                self.bytes.extend([vr[0], vr[1], length[0], length[1]]);
            }
        }
    }

    fn element(&mut self, tag: u32, vr: &[u8; 2], value: &[u8]) {
        self.head(tag, vr, value.len() as u32);
        self.bytes.extend(value);
    }

    fn short(&mut self, tag: u32, value: u16) {
        let value = self.pair(value);
        self.element(tag, b"US", &value);
    }

    fn text(&mut self, tag: u32, vr: &[u8; 2], text: &str) {
        let mut bytes = text.as_bytes().to_vec();
        if bytes.len() % 2 == 1 {
            bytes.push(if vr == b"UI" { 0 } else { b' ' });
        }
        self.element(tag, vr, &bytes);
    }

    fn item(&mut self, bytes: &[u8]) {
        let padded = [bytes, &vec![0; bytes.len() % 2]].concat();
        self.tag(0xFFFE_E000);
        self.long(padded.len() as u32);
        self.bytes.extend(padded);
    }

    /// A sequence of untold length with one item of untold length, as most archives add some.
    fn sequence(&mut self, tag: u32) {
        self.head(tag, b"SQ", u32::MAX);
        self.tag(0xFFFE_E000);
        self.long(u32::MAX);
        self.text(0x0008_1150, b"UI", "1.2.3");
        for end in [0xFFFE_E00D, 0xFFFE_E0DD] {
            self.tag(end);
            self.long(0);
        }
    }
}

/// Slices half a millimetre apart from z = 7 upward, the k-th beginning with 20 k; their names and numbers say nothing of
/// their order.
pub fn series(folder: &Path, count: u16, vary: impl Fn(u16, &mut Slice)) -> Vec<PathBuf> {
    let write = |k: u16| {
        let mut slice = Slice::at(7.0 + 0.5 * f64::from(k), 20 * k);
        slice.number = 1 + (7 * k) % 11;
        vary(k, &mut slice);
        let path = folder.join(format!("IM{:03}.dcm", (5 * k + 3) % 17));
        slice.write(&path);
        path
    };
    (0..count).map(write).collect()
}

/// A closed tetrahedron with legs of 8 mm, as binary glTF, STL text, binary STL, PLY text and binary in both orders, and OBJ.
pub fn tetrahedra() -> Vec<(&'static str, &'static str, Vec<u8>)> {
    let places: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [8.0, 0.0, 0.0], [0.0, 8.0, 0.0], [0.0, 0.0, 8.0]];
    let faces: [[usize; 3]; 4] = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
    let mut text = "solid tooth\n".to_string();
    let mut binary = vec![0; 80];
    binary.extend(4u32.to_le_bytes());
    for face in faces {
        text += "facet normal 0 0 0\n outer loop\n";
        binary.extend([0; 12]);
        for n in face {
            text += &format!("  vertex {} {} {:e}\n", places[n][0], places[n][1], places[n][2]);
            binary.extend(places[n].into_iter().flat_map(f32::to_le_bytes));
        }
        text += " endloop\nendfacet\n";
        binary.extend([0; 2]);
    }
    text += "endsolid tooth\n";
    let ply = |format: &str, kind: &str| {
        format!(
            "ply\nformat {format} 1.0\ncomment a remark\nelement vertex 4\nproperty {kind} x\nproperty {kind} y\n\
             property {kind} z\nproperty uchar red\nelement face 4\nproperty list uchar int vertex_indices\n\
             property float quality\nend_header\n"
        )
    };
    let mut ply_text = ply("ascii", "double");
    places.iter().for_each(|[x, y, z]| ply_text += &format!("{x} {y} {z} 200\n"));
    faces.iter().for_each(|[a, b, c]| ply_text += &format!("3 {a} {b} {c} 0.5\n"));
    let mut little = ply("binary_little_endian", "float").into_bytes();
    let mut big = ply("binary_big_endian", "float").into_bytes();
    for place in places {
        little.extend(place.into_iter().flat_map(f32::to_le_bytes).chain([200]));
        big.extend(place.into_iter().flat_map(f32::to_be_bytes).chain([200]));
    }
    for face in faces {
        little.push(3);
        big.push(3);
        little.extend(face.into_iter().flat_map(|n| (n as i32).to_le_bytes()).chain(0.5f32.to_le_bytes()));
        big.extend(face.into_iter().flat_map(|n| (n as i32).to_be_bytes()).chain(0.5f32.to_be_bytes()));
    }
    let mut obj = String::new();
    places.iter().for_each(|[x, y, z]| obj += &format!("v {x} {y} {z}\n"));
    faces.iter().for_each(|[a, b, c]| obj += &format!("f {} {} {}\n", a + 1, b + 1, c + 1));
    let numbers: Vec<u8> = places.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
    let corners: Vec<u8> = faces.iter().flatten().flat_map(|&n| (n as u16).to_le_bytes()).collect();
    let mut json = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],"accessors":[
        {"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","min":[0,0,0],"max":[8,8,8]},
        {"bufferView":1,"componentType":5123,"count":12,"type":"SCALAR"}],
        "bufferViews":[{"buffer":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":24}],
        "buffers":[{"byteLength":72}]}"#
        .to_string();
    json += &" ".repeat((4 - json.len() % 4) % 4);
    let mut glb = b"glTF".to_vec();
    for word in [2, 28 + json.len() as u32 + 72, json.len() as u32] {
        glb.extend(word.to_le_bytes());
    }
    glb.extend([b"JSON", json.as_bytes(), &72u32.to_le_bytes(), b"BIN\0", &numbers, &corners].concat());
    vec![
        ("glb", "glb", glb),
        ("stl text", "stl", text.into_bytes()),
        ("stl binary", "stl", binary),
        ("ply text", "ply", ply_text.into_bytes()),
        ("ply little", "ply", little),
        ("ply big", "ply", big),
        ("obj", "obj", obj.into_bytes()),
    ]
}
