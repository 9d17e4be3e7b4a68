//! Bytes of buffers and buffer views.

use super::{
    data_uri,
    document::{Document, extension, item},
    meshopt,
    types::{Meshopt, View},
};
use crate::{
    Error, ErrorKind, Result,
    scene::{Limits, budget::Budget, folder::Folder},
};
use std::{
    cell::OnceCell,
    collections::{HashMap, hash_map::Entry},
    path::PathBuf,
};

const MESHOPT: &str = "EXT_meshopt_compression";

/// All buffers of a file, and its compressed views once they are decoded.
#[derive(Debug)]
pub struct Buffers<'a> {
    document: &'a Document,
    budget: &'a Budget,
    max_alloc: u64,
    /// `None`: a placeholder for what a compressed view decodes to.
    buffers: Vec<Option<Bytes<'a>>>,
    files: HashMap<PathBuf, Vec<u8>>,
    decoded: Vec<OnceCell<Vec<u8>>>,
}

#[derive(Debug)]
enum Bytes<'a> {
    Chunk(&'a [u8]),
    Inline(Vec<u8>),
    /// The file, and how many bytes of it belong to the buffer.
    File(PathBuf, usize),
}

impl<'a> Buffers<'a> {
    /// Reads every buffer of `document`.
    pub fn read(
        document: &'a Document,
        bin: Option<&'a [u8]>,
        folder: &Folder,
        limits: &Limits,
        budget: &'a Budget,
    ) -> Result<Self> {
        let mut out = Self {
            document,
            budget,
            max_alloc: limits.max_alloc,
            buffers: Vec::new(),
            files: HashMap::new(),
            decoded: (0..document.views.len()).map(|_| OnceCell::new()).collect(),
        };
        let mut left = limits.max_file;
        for i in 0..document.buffers.len() {
            let bytes = out.read_one(i, bin, folder, &mut left).map_err(|error| error.at(format!("buffers[{i}]")))?;
            out.buffers.push(bytes);
        }
        Ok(out)
    }

    fn read_one(
        &mut self,
        i: usize,
        bin: Option<&'a [u8]>,
        folder: &Folder,
        left: &mut u64,
    ) -> Result<Option<Bytes<'a>>> {
        let buffer = &self.document.buffers[i];
        let length = buffer.byte_length;
        if length == 0 || length > self.max_alloc {
            let allowed = self.max_alloc;
            return Err(Error::input(format!("{length} bytes, 1 to {allowed} are allowed")).at("byteLength"));
        }
        let (bytes, found) = match &buffer.uri {
            None if i == 0 && bin.is_some() => {
                let chunk = bin.unwrap_or_default();
                (Bytes::Chunk(chunk), chunk.len())
            }
            // Nothing can be read from it; who tries is told so.
            None => return Ok(None),
            Some(uri) => match data_uri::decode(uri) {
                Some(data) => {
                    let data = data.map_err(|error| error.at("uri"))?;
                    let length = data.bytes.len();
                    (Bytes::Inline(data.bytes), length)
                }
                None => {
                    let path = folder.resolve_uri(uri).map_err(|error| error.at("uri"))?;
                    let found = match self.files.entry(path.clone()) {
                        Entry::Occupied(entry) => entry.get().len(),
                        Entry::Vacant(entry) => {
                            let bytes =
                                folder.read(&path, self.max_alloc.min(*left)).map_err(|error| error.at("uri"))?;
                            *left -= bytes.len() as u64;
                            self.budget.read(bytes.len());
                            entry.insert(bytes).len()
                        }
                    };
                    (Bytes::File(path, usize::try_from(length).unwrap_or(usize::MAX)), found)
                }
            },
        };
        if length > found as u64 {
            return Err(Error::input(format!("says {length} bytes, but there are {found}"))
                .at("byteLength")
                .help("The buffer is damaged or cut off; export or copy it again"));
        }
        Ok(Some(match bytes {
            Bytes::Chunk(chunk) => Bytes::Chunk(&chunk[..length as usize]),
            Bytes::Inline(mut bytes) => {
                bytes.truncate(length as usize);
                Bytes::Inline(bytes)
            }
            file @ Bytes::File(..) => file,
        }))
    }

    /// Checks what every view refers to, used or not.
    pub fn check_views(&self) -> Result<()> {
        for (i, view) in self.document.views.iter().enumerate() {
            let check = || {
                item(&self.document.buffers, "buffers", view.buffer)?;
                let length = self.document.buffers[view.buffer as usize].byte_length;
                if view.byte_offset.checked_add(view.byte_length).is_none_or(|end| end > length) {
                    return Err(Error::input(format!(
                        "bytes {0} to {0}+{1} are wanted, buffers[{2}] has {length}",
                        view.byte_offset, view.byte_length, view.buffer
                    )));
                }
                if let Some(packed) = extension::<Meshopt>(&view.extensions, MESHOPT)? {
                    item(&self.document.buffers, "buffers", packed.buffer)?;
                }
                Ok(())
            };
            check().map_err(|error: Error| error.at(format!("bufferViews[{i}]")))?;
        }
        Ok(())
    }

    fn buffer(&self, index: u32) -> Result<&[u8]> {
        item(&self.document.buffers, "buffers", index)?;
        match &self.buffers[index as usize] {
            Some(Bytes::Chunk(chunk)) => Ok(chunk),
            Some(Bytes::Inline(bytes)) => Ok(bytes),
            Some(Bytes::File(path, length)) => {
                Ok(self.files.get(path).and_then(|bytes| bytes.get(..*length)).unwrap_or_default())
            }
            None => {
                Err(Error::input("has no uri, and the file has no BIN chunk for it").at(format!("buffers[{index}]")))
            }
        }
    }

    /// A range of a buffer.
    fn range(&self, buffer: u32, offset: u64, length: u64) -> Result<&[u8]> {
        let bytes = self.buffer(buffer)?;
        let end = offset.checked_add(length).filter(|&end| end <= bytes.len() as u64);
        match end {
            Some(end) => Ok(&bytes[offset as usize..end as usize]),
            None => Err(Error::input(format!(
                "bytes {offset} to {offset}+{length} are wanted, buffers[{buffer}] has {}",
                bytes.len()
            ))),
        }
    }

    /// The bytes of a buffer view, decompressed if it is compressed.
    pub fn view(&self, index: u32) -> Result<&[u8]> {
        let view = item(&self.document.views, "bufferViews", index)?;
        let at = |error: Error| error.at(format!("bufferViews[{index}]"));
        let Some(packed) = extension::<Meshopt>(&view.extensions, MESHOPT).map_err(at)? else {
            return self.range(view.buffer, view.byte_offset, view.byte_length).map_err(at);
        };
        let cell = &self.decoded[index as usize];
        if let Some(bytes) = cell.get() {
            return Ok(bytes);
        }
        let bytes = self.unpack(view, &packed).map_err(|error| at(error.at(format!("extensions.{MESHOPT}"))))?;
        Ok(cell.get_or_init(|| bytes))
    }

    fn unpack(&self, view: &View, packed: &Meshopt) -> Result<Vec<u8>> {
        let size = packed.count.saturating_mul(packed.byte_stride);
        if size != view.byte_length {
            let (count, stride, length) = (packed.count, packed.byte_stride, view.byte_length);
            return Err(Error::input(format!("{count} elements of {stride} bytes do not fill the view's {length}")));
        }
        let mode = match packed.mode.as_str() {
            "ATTRIBUTES" => meshopt::Mode::Attributes,
            "TRIANGLES" => meshopt::Mode::Triangles,
            "INDICES" => meshopt::Mode::Indices,
            other => return Err(Error::input(format!("mode {other:?} is unknown")).at("mode")),
        };
        let filter = match packed.filter.as_deref() {
            None | Some("NONE") => meshopt::Filter::None,
            Some("OCTAHEDRAL") => meshopt::Filter::Octahedral,
            Some("QUATERNION") => meshopt::Filter::Quaternion,
            Some("EXPONENTIAL") => meshopt::Filter::Exponential,
            Some(other) => return Err(Error::input(format!("filter {other:?} is unknown")).at("filter")),
        };
        let data = self.range(packed.buffer, packed.byte_offset, packed.byte_length)?;
        // Indices pass through a list of 32 bits.
        self.budget.take(packed.count, packed.byte_stride.saturating_add(4))?;
        let count = usize::try_from(packed.count).map_err(|_| out_of_memory(packed.count))?;
        meshopt::decode(data, mode, filter, count, packed.byte_stride as usize)
    }
}

fn out_of_memory(count: u64) -> Error {
    Error::new(ErrorKind::OutOfMemory, format!("no memory for {count} elements"))
}
