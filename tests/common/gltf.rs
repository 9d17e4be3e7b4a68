//! Small glTF files made by tests.

use lucerna::{
    Result,
    scene::{LoadOptions, Scene, load},
};
use serde_json::{Value, json};

/// A red PNG of one texel.
pub const PNG: &str = "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAIAAACQd1PeAAAADElEQVR4nGP4z8AAAAMBAQDJ/pLvAAAAAElFTkSuQmCC";

/// Numbers to little-endian bytes.
pub fn bytes<T: Copy, const N: usize>(values: &[T], encode: fn(T) -> [u8; N]) -> Vec<u8> {
    values.iter().flat_map(|&value| encode(value)).collect()
}

/// A file under construction: its JSON and its binary chunk.
#[derive(Clone, Debug)]
pub struct File {
    pub json: Value,
    pub bin: Vec<u8>,
}

impl File {
    pub fn new() -> Self {
        let json = json!({
            "asset": {"version": "2.0"}, "buffers": [], "bufferViews": [], "accessors": [], "meshes": [], "nodes": [],
            "materials": [],
        });
        Self { json, bin: vec![] }
    }

    /// Appends an object to a list and gives its index.
    pub fn add(&mut self, list: &str, object: Value) -> usize {
        if self.json[list].is_null() {
            self.json[list] = json!([]);
        }
        let list = self.json[list].as_array_mut().unwrap();
        list.push(object);
        list.len() - 1
    }

    pub fn view(&mut self, data: &[u8]) -> usize {
        while !self.bin.len().is_multiple_of(4) {
            self.bin.push(0);
        }
        let offset = self.bin.len();
        self.bin.extend_from_slice(data);
        self.add("bufferViews", json!({"buffer": 0, "byteOffset": offset, "byteLength": data.len()}))
    }

    pub fn accessor(&mut self, kind: &str, component: u32, count: usize, data: &[u8]) -> usize {
        let view = self.view(data);
        self.add("accessors", json!({"bufferView": view, "type": kind, "componentType": component, "count": count}))
    }

    pub fn floats(&mut self, kind: &str, values: &[f32]) -> usize {
        let width = match kind {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" => 4,
            _ => 16,
        };
        self.accessor(kind, 5126, values.len() / width, &bytes(values, f32::to_le_bytes))
    }

    pub fn indices(&mut self, values: &[u32]) -> usize {
        self.accessor("SCALAR", 5125, values.len(), &bytes(values, u32::to_le_bytes))
    }

    /// A mesh of one primitive, at a node of its own.
    pub fn mesh(&mut self, primitive: Value) -> usize {
        let mesh = self.add("meshes", json!({"primitives": [primitive]}));
        self.add("nodes", json!({"mesh": mesh}))
    }

    /// A unit square in the xy plane of two triangles, with normals and texture coordinates.
    pub fn square() -> Self {
        let mut file = Self::new();
        let position = file.floats("VEC3", &[0., 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0.]);
        let normal = file.floats("VEC3", &[0., 0., 1., 0., 0., 1., 0., 0., 1., 0., 0., 1.]);
        let uv = file.floats("VEC2", &[0., 1., 1., 1., 1., 0., 0., 0.]);
        let indices = file.indices(&[0, 1, 2, 0, 2, 3]);
        let attributes = json!({"POSITION": position, "NORMAL": normal, "TEXCOORD_0": uv});
        file.mesh(json!({"attributes": attributes, "indices": indices}));
        file
    }

    pub fn primitive(&mut self) -> &mut Value {
        &mut self.json["meshes"][0]["primitives"][0]
    }

    /// The file as a GLB container.
    pub fn glb(&self) -> Vec<u8> {
        let mut json = self.json.clone();
        for list in ["buffers", "bufferViews", "accessors", "meshes", "nodes", "materials"] {
            if json[list].as_array().is_some_and(|list| list.is_empty()) {
                json.as_object_mut().unwrap().remove(list);
            }
        }
        if !self.bin.is_empty() && json["buffers"].is_null() {
            json["buffers"] = json!([{"byteLength": self.bin.len()}]);
        }
        glb(json.to_string().as_bytes(), &self.bin)
    }

    pub fn load(&self) -> Result<Scene> {
        load_bytes("test.glb", &self.glb())
    }

    /// The message of the error that loading ends in.
    pub fn error(&self) -> String {
        let error = self.load().expect_err("the file was read");
        error.to_string().rsplit_once("test.glb: ").map_or_else(|| error.to_string(), |(_, rest)| rest.to_owned())
    }
}

/// A GLB container of a JSON and a binary chunk.
pub fn glb(json: &[u8], bin: &[u8]) -> Vec<u8> {
    let mut out = vec![];
    for (kind, data, fill) in [(b"JSON", json, b' '), (b"BIN\0", bin, 0)] {
        let length = data.len().next_multiple_of(4);
        out.extend((length as u32).to_le_bytes());
        out.extend(kind);
        out.extend(data);
        out.resize(out.len() + length - data.len(), fill);
    }
    let length = out.len() as u32 + 12;
    [b"glTF".as_slice(), &2u32.to_le_bytes(), &length.to_le_bytes(), &out].concat()
}

/// Loads `content` from a file `name` in a folder of its own.
pub fn load_bytes(name: &str, content: &[u8]) -> Result<Scene> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, content).unwrap();
    load(path, &LoadOptions::default())
}
