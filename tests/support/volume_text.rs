//! Small NRRD files as text, to be varied and broken one line at a time.

#![allow(dead_code)]

use flate2::{Compression, GzBuilder};
use std::io::Write;

/// A header's lines and what follows them.
#[derive(Clone)]
pub struct Text {
    pub magic: String,
    pub lines: Vec<String>,
    pub line_end: &'static str,
    pub data: Vec<u8>,
}

impl Text {
    /// 4×3×2 voxels of uint8, raw, holding 0 to 23. `type` is on line 2, and so on in the order below.
    pub fn good() -> Text {
        let lines = [
            "type: uint8",
            "dimension: 3",
            "space: left-posterior-superior",
            "sizes: 4 3 2",
            "space directions: (0.5,0,0) (0,0.25,0) (0,0,2)",
            "kinds: domain domain domain",
            "encoding: raw",
            "space origin: (1,2,3)",
        ];
        Text {
            magic: "NRRD0004".to_string(),
            lines: lines.map(str::to_string).to_vec(),
            line_end: "\n",
            data: (0..24).collect(),
        }
    }

    /// Replaces the line of the same field, or adds one.
    pub fn with(mut self, line: &str) -> Text {
        let field = |line: &str| line.split(':').next().map(str::to_lowercase);
        match self.lines.iter_mut().find(|known| field(known) == field(line)) {
            Some(known) => *known = line.to_string(),
            None => self.lines.push(line.to_string()),
        }
        self
    }

    pub fn adding(mut self, line: &str) -> Text {
        self.lines.push(line.to_string());
        self
    }

    pub fn without(mut self, field: &str) -> Text {
        self.lines.retain(|line| !line.starts_with(&format!("{field}:")));
        self
    }

    pub fn data(mut self, data: Vec<u8>) -> Text {
        self.data = data;
        self
    }

    /// The same, compressed.
    pub fn gzip(self) -> Text {
        let data = gzip(&self.data);
        self.with("encoding: gzip").data(data)
    }

    pub fn header(&self) -> Vec<u8> {
        let lines = std::iter::once(&self.magic).chain(&self.lines).map(|line| format!("{line}{}", self.line_end));
        lines.collect::<String>().into_bytes()
    }

    pub fn bytes(&self) -> Vec<u8> {
        [self.header(), self.line_end.as_bytes().to_vec(), self.data.clone()].concat()
    }
}

pub fn gzip(data: &[u8]) -> Vec<u8> {
    let mut gzip = GzBuilder::new().mtime(0).write(Vec::new(), Compression::best());
    gzip.write_all(data).unwrap();
    gzip.finish().unwrap()
}
