//! A copy of egui's textures in main memory.
//!
//! egui sends each change of a texture once. After the loss of a device all textures are uploaded from here. Changes
//! that come while the window is hidden wait here too.

use egui::epaint::ImageDelta;
use egui::{Color32, ColorImage, ImageData, TextureId, TextureOptions};
use std::collections::HashMap;
use std::sync::Arc;

/// More small changes of one texture than this are uploaded as one whole.
const MOST_REGIONS: usize = 64;

/// A part of a texture that the device does not have yet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Upload {
    pub id: TextureId,
    pub position: [usize; 2],
    pub size: [usize; 2],
}

/// The present images of all textures.
#[derive(Default)]
pub struct Textures {
    images: HashMap<TextureId, (Arc<ColorImage>, TextureOptions)>,
    uploads: Vec<Upload>,
}

impl Textures {
    /// The image of a texture and how it is sampled.
    pub fn get(&self, id: TextureId) -> Option<(&ColorImage, TextureOptions)> {
        self.images.get(&id).map(|(image, options)| (&**image, *options))
    }

    /// Takes over a change.
    pub fn set(&mut self, id: TextureId, delta: ImageDelta) {
        let ImageData::Color(change) = delta.image;
        let Some(position) = delta.pos else {
            self.images.insert(id, (change, delta.options));
            self.upload_whole(id);
            return;
        };
        let Some((image, options)) = self.images.get_mut(&id) else {
            log::error!("egui changes a part of the texture {id:?}, which it has not made.");
            return;
        };
        let fits = (0..2).all(|axis| position[axis] + change.size[axis] <= image.size[axis]);
        if !fits || change.size.contains(&0) {
            log::error!("A change of {:?} pixels at {position:?} is not inside {:?} pixels.", change.size, image.size);
            return;
        }
        let new_options = *options != delta.options;
        *options = delta.options;
        copy_into(Arc::make_mut(image), &change, position);
        let size = image.size;
        let earlier = self.uploads.iter().filter(|u| u.id == id);
        if new_options || earlier.clone().count() >= MOST_REGIONS {
            self.upload_whole(id);
        } else if !earlier.into_iter().any(|u| u.size == size) {
            self.uploads.push(Upload { id, position, size: change.size });
        }
    }

    /// Forgets a texture. Call it after the frame in which egui has freed it.
    pub fn free(&mut self, id: TextureId) {
        self.images.remove(&id);
        self.uploads.retain(|u| u.id != id);
    }

    /// The parts that the device does not have yet. The caller uploads them.
    pub fn take_uploads(&mut self) -> Vec<Upload> {
        std::mem::take(&mut self.uploads)
    }

    /// Marks all textures: a new device has none of them.
    pub fn upload_all(&mut self) {
        let ids: Vec<_> = self.images.keys().copied().collect();
        ids.into_iter().for_each(|id| self.upload_whole(id));
    }

    fn upload_whole(&mut self, id: TextureId) {
        self.uploads.retain(|u| u.id != id);
        if let Some((image, _)) = self.images.get(&id) {
            self.uploads.push(Upload { id, position: [0, 0], size: image.size });
        }
    }
}

/// Copies a smaller image to a position in a larger one.
fn copy_into(image: &mut ColorImage, change: &ColorImage, [x, y]: [usize; 2]) {
    let width = change.size[0];
    let targets = image.pixels.chunks_exact_mut(image.size[0].max(1)).skip(y);
    let sources = change.pixels.chunks_exact(width.max(1));
    for (target, source) in targets.zip(sources) {
        let target: Option<&mut [Color32]> = target.get_mut(x..x + width);
        if let Some(target) = target {
            target.copy_from_slice(source);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(size: [usize; 2], color: Color32) -> ColorImage {
        ColorImage::filled(size, color)
    }

    const ID: TextureId = TextureId::Managed(7);

    #[test]
    fn partial_changes_are_kept() {
        let mut textures = Textures::default();
        textures.set(ID, ImageDelta::full(image([4, 3], Color32::BLACK), TextureOptions::NEAREST));
        assert_eq!(textures.take_uploads(), [Upload { id: ID, position: [0, 0], size: [4, 3] }]);
        textures.set(ID, ImageDelta::partial([1, 2], image([2, 1], Color32::RED), TextureOptions::NEAREST));
        let part = Upload { id: ID, position: [1, 2], size: [2, 1] };
        assert_eq!(textures.take_uploads(), [part]);
        let (now, _) = textures.get(ID).unwrap_or_else(|| unreachable!());
        let red: Vec<_> = (0..12).filter(|i| now.pixels[*i] == Color32::RED).collect();
        assert_eq!(red, [9, 10]);
    }

    #[test]
    fn waiting_uploads_do_not_pile_up() {
        let mut textures = Textures::default();
        textures.set(ID, ImageDelta::full(image([4, 4], Color32::BLACK), TextureOptions::NEAREST));
        textures.take_uploads();
        for i in 0..1000 {
            let part = image([1, 1], Color32::from_gray(i as u8));
            textures.set(ID, ImageDelta::partial([i % 4, 0], part, TextureOptions::NEAREST));
        }
        assert!(textures.take_uploads().len() <= MOST_REGIONS + 1);
    }

    #[test]
    fn wrong_changes_are_ignored() {
        let mut textures = Textures::default();
        textures.set(ID, ImageDelta::partial([0, 0], image([1, 1], Color32::RED), TextureOptions::LINEAR));
        textures.set(ID, ImageDelta::full(image([2, 2], Color32::BLACK), TextureOptions::LINEAR));
        textures.set(ID, ImageDelta::partial([1, 1], image([2, 1], Color32::RED), TextureOptions::LINEAR));
        assert_eq!(textures.take_uploads().len(), 1);
        textures.free(ID);
        textures.upload_all();
        assert!(textures.take_uploads().is_empty());
    }
}
