//! Scenes inside a .zip, read without unpacking. The limits are those of folders: nothing outside of the archive is read, and no entry may be larger
//! than a file may be. An archive whose entries would leave its folder, or unpack to far more than its size, is refused.

use std::{
    cell::{Cell, RefCell},
    collections::BTreeMap,
    fs::File,
    io::{BufReader, Read},
    path::{Path, PathBuf},
};

use zip::ZipArchive;

use super::folder::{checked_path, shorten};
use crate::{Error, ErrorKind, Result};

/// The first bytes of every archive that has an entry.
pub const MAGIC: &[u8] = b"PK\x03\x04";
/// Entries at most.
const MOST: usize = 1 << 16;
/// Bytes that all entries together may have: this many, and so many times the size of the archive.
const BASE: u64 = 256 << 20;
const FACTOR: u64 = 64;

/// An open archive.
#[derive(Debug)]
pub struct Archive {
    zip: RefCell<ZipArchive<BufReader<File>>>,
    /// Numbers of the files by their paths.
    files: BTreeMap<PathBuf, usize>,
    /// Bytes that may still be unpacked.
    left: Cell<u64>,
}

fn damaged(error: zip::result::ZipError) -> Error {
    Error::input("the archive is damaged, or of a kind that is not read")
        .caused_by(error)
        .help("Read are stored and deflated entries without a password")
}

impl Archive {
    /// Opens an archive and looks at the names of all entries.
    ///
    /// # Errors
    /// `Input` if it is damaged, or if an entry leads out of it.
    pub fn open(path: &Path) -> Result<Self> {
        let cannot = |error| Error::input("the file cannot be read").caused_by(error);
        let file = File::open(path).map_err(cannot)?;
        let size = file.metadata().map_err(cannot)?.len();
        let mut zip = ZipArchive::new(BufReader::new(file)).map_err(damaged)?;
        if zip.len() > MOST {
            return Err(Error::input(format!("{} entries, at most {MOST} are read", zip.len())));
        }
        let mut files = BTreeMap::new();
        for number in 0..zip.len() {
            let entry = zip.by_index_raw(number).map_err(damaged)?;
            if entry.is_dir() {
                continue;
            }
            let name = entry.name().map_err(damaged)?.replace('\\', "/");
            let path = checked_path(&name)?;
            if entry.is_symlink() {
                return Err(Error::input(format!("the entry {:?} is a link", shorten(&name)))
                    .help("Make an archive of files alone"));
            }
            files.insert(path, number);
        }
        Ok(Self { zip: RefCell::new(zip), files, left: Cell::new(BASE.saturating_add(size.saturating_mul(FACTOR))) })
    }

    /// The one scene of the archive: of several, the one that lies nearest to the top.
    ///
    /// # Errors
    /// `Input` if there is none or more than one.
    pub fn scene(&self, is_scene: impl Fn(&Path) -> bool) -> Result<PathBuf> {
        let scenes: Vec<&PathBuf> = self.files.keys().filter(|path| is_scene(path)).collect();
        let depth = |path: &Path| path.components().count();
        let top = scenes.iter().map(|path| depth(path)).min();
        let first: Vec<&PathBuf> = scenes.into_iter().filter(|path| Some(depth(path)) == top).collect();
        match first[..] {
            [only] => Ok(only.clone()),
            [] => Err(Error::input("has no scene").help("A .gltf, .glb or .obj file must be in the archive")),
            _ => {
                let names: Vec<String> = first.iter().take(8).map(|path| path.display().to_string()).collect();
                Err(Error::input(format!("has several scenes: {}", names.join(", ")))
                    .help("Leave one in the archive, or unpack it"))
            }
        }
    }

    pub fn has(&self, path: &Path) -> bool {
        self.files.contains_key(path)
    }

    /// The bytes of a file, at most `limit`.
    ///
    /// # Errors
    /// `Input` if it is damaged or too large.
    pub fn read(&self, path: &Path, limit: u64) -> Result<Vec<u8>> {
        let name = path.display();
        let Some(number) = self.files.get(path) else {
            return Err(Error::input(format!("{name} is not in the archive")));
        };
        let mut zip = self.zip.borrow_mut();
        let entry = zip.by_index(*number).map_err(|error| damaged(error).at(name.to_string()))?;
        let allowed = limit.min(self.left.get());
        let too_large = |size: u64| {
            let what = format!("{name} has {size} bytes or more, {allowed} are allowed");
            Error::input(what).help("An archive may unpack to 256 MiB and 64 times its size")
        };
        if entry.size() > allowed {
            return Err(too_large(entry.size()));
        }
        let mut bytes = Vec::new();
        bytes.try_reserve(usize::try_from(entry.size()).unwrap_or(usize::MAX)).map_err(|error| {
            Error::new(ErrorKind::OutOfMemory, format!("no memory for the {} bytes of {name}", entry.size()))
                .caused_by(error)
        })?;
        // Whatever the entry says of its size, no more is unpacked.
        entry
            .take(allowed.saturating_add(1))
            .read_to_end(&mut bytes)
            .map_err(|error| Error::input(format!("{name} is damaged")).caused_by(error))?;
        if bytes.len() as u64 > allowed {
            return Err(too_large(bytes.len() as u64));
        }
        self.left.set(self.left.get() - bytes.len() as u64);
        Ok(bytes)
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use zip::{CompressionMethod, ZipWriter, write::SimpleFileOptions};

    use crate::scene::{LoadOptions, load};

    use super::*;

    const OBJ: &str = "mtllib own/a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl red\nf 1/1 2/1 3/1\n";
    const MTL: &str = "newmtl red\nKd 1 0 0\nmap_Kd ../tex/a.bmp\n";
    const MTL_BESIDE: &str = "newmtl red\nKd 1 0 0\nmap_Kd tex/a.bmp\n";

    /// One green pixel.
    fn bmp() -> Vec<u8> {
        let mut out = b"BM".to_vec();
        for word in [58u32, 0, 54, 40, 1, 1, 1 | 24 << 16, 0, 4, 0, 0, 0, 0] {
            out.extend(word.to_le_bytes());
        }
        out.extend([0, 255, 0, 0]);
        out
    }

    fn packed(entries: &[(&str, &[u8])], method: CompressionMethod) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        let mut zip = ZipWriter::new(File::create(folder.path().join("a.zip")).unwrap());
        for (name, bytes) in entries {
            zip.start_file(*name, SimpleFileOptions::default().compression_method(method)).unwrap();
            zip.write_all(bytes).unwrap();
        }
        zip.finish().unwrap();
        folder
    }

    fn loaded(entries: &[(&str, &[u8])]) -> Result<crate::scene::Scene> {
        let folder = packed(entries, CompressionMethod::Deflated);
        load(folder.path().join("a.zip"), &LoadOptions::default())
    }

    #[test]
    fn a_scene_is_read_with_its_material_and_its_texture() {
        let bmp = bmp();
        for method in [CompressionMethod::Stored, CompressionMethod::Deflated] {
            let entries: [(&str, &[u8]); 3] = [
                ("room/room.obj", OBJ.as_bytes()),
                ("room/own/a.mtl", MTL_BESIDE.as_bytes()),
                ("room/tex/a.bmp", &bmp),
            ];
            let folder = packed(&entries, method);
            let scene = load(folder.path().join("a.zip"), &LoadOptions::default()).unwrap();
            assert_eq!(
                (scene.name.as_str(), scene.meshes.len(), scene.textures.len()),
                ("room", 1, 1),
                "{:?}",
                scene.notes
            );
            assert_eq!(scene.textures[0].rgba, [[0, 255, 0, 255]]);
        }
        // Beside the scene nearest to the top others may lie deeper.
        assert!(loaded(&[("a.obj", OBJ.as_bytes()), ("more/b.obj", b"v 0 0 0\n")]).is_ok());
    }

    #[test]
    fn nothing_outside_is_read_and_hostile_archives_are_refused() {
        // A texture that leads out of the folder is left out, as with folders.
        let scene = loaded(&[("room.obj", OBJ.as_bytes()), ("own/a.mtl", MTL.as_bytes())]).unwrap();
        assert!(scene.textures.is_empty() && !scene.notes.is_empty());
        for (entries, part) in [
            (&[("../a.obj", OBJ.as_bytes())][..], "leads out of the folder"),
            (&[("/etc/a.obj", OBJ.as_bytes())], "is absolute"),
            (&[("a.obj", OBJ.as_bytes()), ("c:/b", b"x")], "has a colon"),
            (&[("a.txt", b"x")], "has no scene"),
            (&[("a.obj", OBJ.as_bytes()), ("b.glb", b"x")], "has several scenes: a.obj, b.glb"),
        ] {
            let error = loaded(entries).unwrap_err();
            assert!(error.exit_code() == 3 && error.to_string().contains(part), "{error}");
        }
        // Much more than the archive has: 400 MB of nothing in 400 kB.
        let folder = tempfile::tempdir().unwrap();
        let mut zip = ZipWriter::new(File::create(folder.path().join("a.zip")).unwrap());
        zip.start_file("a.obj", SimpleFileOptions::default().compression_method(CompressionMethod::Deflated)).unwrap();
        let spaces = vec![b' '; 1 << 20];
        (0..400).for_each(|_| zip.write_all(&spaces).unwrap());
        zip.finish().unwrap();
        let error = load(folder.path().join("a.zip"), &LoadOptions::default()).unwrap_err();
        assert!(error.exit_code() == 3 && error.to_string().contains("are allowed"), "{error}");
    }

    #[test]
    fn damaged_archives_have_an_answer() {
        let folder = packed(&[("a.obj", OBJ.as_bytes()), ("own/a.mtl", MTL.as_bytes())], CompressionMethod::Deflated);
        let file = folder.path().join("a.zip");
        let good = std::fs::read(&file).unwrap();
        for at in (0..good.len()).step_by(3) {
            for bytes in [good[..at].to_vec(), [&good[..at], &[good[at] ^ 0x55], &good[at + 1..]].concat()] {
                std::fs::write(&file, bytes).unwrap();
                let _ = load(&file, &LoadOptions::default());
            }
        }
    }
}
