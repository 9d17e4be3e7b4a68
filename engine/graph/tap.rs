//! Looking into a graph from outside: any image by its name, for `--view` and `--dump`.

use super::{
    Graph,
    access::Collector,
    format::{Class, Format},
    handles::{Image, ImageRead},
    pixels::Pixels,
    plan::Plan,
    vocab::Resource,
};
use crate::{Error, ErrorKind, Result};

impl Graph {
    /// The plan of the passes declared so far, for `--list-passes` ([`Plan::list_passes`]).
    ///
    /// # Errors
    /// `Runtime`, with every mistake of the graph.
    pub fn plan(&self) -> Result<Plan> {
        Plan::new(self).map_err(|mistakes| {
            let lines: Vec<String> = mistakes.iter().map(ToString::to_string).collect();
            let what = format!("graph `{}` has {} mistakes: {}", self.name(), lines.len(), lines.join("; "));
            Error::new(ErrorKind::Runtime, what)
        })
    }

    /// Names of the images whose first level is written by the passes declared so far, in the order of declaration.
    pub fn image_names(&self) -> Vec<&str> {
        self.written().into_iter().map(|i| self.images[i as usize].name.as_str()).collect()
    }

    /// The image of this name.
    pub fn find_image(&self, name: &str) -> Option<Image> {
        self.images.iter().position(|i| i.name == name).map(|i| self.whole_image(i as u32))
    }

    /// Promises the first level of the image called `name`, as it is after the passes declared so far.
    ///
    /// # Errors
    /// `Usage`, listing the names, if no pass writes such an image.
    pub fn view(&mut self, name: &str) -> Result<ImageRead> {
        let found = self.written().into_iter().find(|i| self.images[*i as usize].name == name);
        match found {
            Some(index) => Ok(self.read_image(self.whole_image(index).mip(0))),
            None => Err(Error::usage(format!("no pass writes an image `{name}`"))
                .help(format!("Names are {}", self.image_names().join(", ")))),
        }
    }

    /// Promises the first level of every image that the passes declared so far write, with their names.
    pub fn dump(&mut self) -> Vec<(String, ImageRead)> {
        let all = self.written();
        let named = all.into_iter().map(|i| (self.images[i as usize].name.clone(), self.whole_image(i).mip(0)));
        let named: Vec<_> = named.collect();
        named.into_iter().map(|(name, image)| (name, self.read_image(image))).collect()
    }

    /// Images all layers of whose first level are written, and whose format the engine can decode.
    fn written(&self) -> Vec<u32> {
        let mut layers: Vec<Vec<bool>> = self.images.iter().map(|i| vec![false; i.desc.layers as usize]).collect();
        for pass in &self.passes {
            for u in Collector::collect(self, pass).uses {
                if let (Resource::Image(i), true, 0) = (u.resource, u.writes(), u.region.a.0) {
                    layers[i as usize][u.region.b.0 as usize..u.region.b.1 as usize].fill(true);
                }
            }
        }
        let whole = |i: &usize| layers[*i].iter().all(|l| *l) && !matches!(self.images[*i].desc.format, Format::Raw(_));
        (0..self.images.len()).filter(whole).map(|i| i as u32).collect()
    }
}

impl Pixels {
    /// The values as a picture to look at: depth is stretched to black (far) to white (the nearest), images whose name ends
    /// in `normal` and that have negative values map [-1, 1] to [0, 1], one channel is grey. Everything else stays as it is.
    pub fn picture(&self) -> Vec<[f32; 4]> {
        let mut values = self.to_f32();
        let finite = |v: &f32| v.is_finite();
        if matches!(self.format.class(), Class::Depth | Class::DepthStencil) {
            let largest = values.iter().map(|p| p[0]).filter(finite).fold(0.0, f32::max);
            let scale = if largest > 0.0 { 1.0 / largest } else { 1.0 };
            values.iter_mut().for_each(|p| p[0] *= scale);
        }
        let signed = values.iter().any(|p| p[..3].iter().any(|v| *v < 0.0));
        if signed && self.name.trim_end_matches(|c: char| c == '#' || c.is_ascii_digit()).ends_with("normal") {
            values.iter_mut().for_each(|p| (0..3).for_each(|c| p[c] = p[c] * 0.5 + 0.5));
        } else if self.format.channels() == 1 {
            values.iter_mut().for_each(|p| *p = [p[0], p[0], p[0], 1.0]);
        }
        values
    }
}
