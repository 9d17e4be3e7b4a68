//! Encoding of nodes for the shaders (`lib/trace_compute.glsl`). `rays/refit.comp` computes the same encoding on the device.

use super::tree::{Child, Node, Tree};
use crate::scene::Aabb;
use glam::Vec3;

/// Size of an encoded node, 32-bit words.
pub const WORDS: usize = 20;

/// Appends the nodes of `tree`. Node references are relative to `first_node`, leaf references to `first_leaf`.
pub fn encode(tree: &Tree, first_node: u32, first_leaf: u32, out: &mut Vec<u32>) {
    for node in &tree.nodes {
        out.extend(words(node, first_node, first_leaf));
    }
}

fn words(node: &Node, first_node: u32, first_leaf: u32) -> [u32; WORDS] {
    let mut words = [0; WORDS];
    let (mut inner, mut leaves) = ((u32::MAX, 0u32), (u32::MAX, 0u32));
    for (slot, child) in node.children.iter().enumerate() {
        let (kind, index) = match *child {
            Child::Empty => continue,
            Child::Node(index) => (&mut inner, first_node + index),
            Child::Leaf(index) => (&mut leaves, first_leaf + index),
        };
        *kind = (kind.0.min(index), kind.1 | 1 << slot);
    }
    let reference = |(first, mask): (u32, u32)| if mask == 0 { 0 } else { first << 8 | mask };
    let all = node.boxes.iter().copied().fold(Aabb::EMPTY, Aabb::union);
    let all = if all.is_empty() { Aabb { min: Vec3::ZERO, max: Vec3::ZERO } } else { all };
    let exponents = [0, 1, 2].map(|axis| exponent(all.min[axis], all.max[axis]));
    for axis in 0..3 {
        words[axis] = all.min[axis].to_bits();
        words[3] |= exponents[axis] << (8 * axis);
    }
    words[4] = reference(inner);
    words[5] = reference(leaves);
    for (slot, aabb) in node.boxes.iter().enumerate().filter(|(_, b)| !b.is_empty()) {
        for axis in 0..3 {
            let scale = f32::from_bits(exponents[axis] << 23);
            let [low, high] = quantised(aabb.min[axis], aabb.max[axis], all.min[axis], scale);
            let shift = 8 * (slot % 4);
            words[6 + 2 * axis + slot / 4] |= low << shift;
            words[12 + 2 * axis + slot / 4] |= high << shift;
        }
    }
    words
}

/// Biased exponent of the smallest power of two such that 254 steps of it cover the range from `low` to `high`.
fn exponent(low: f32, high: f32) -> u32 {
    // A byte has 255 steps; one of them is reserved for rounding.
    let step = ((high - low) / 254.0).clamp(1e-30, 1e30).to_bits();
    (step >> 23) + u32::from(step & 0x7f_ffff != 0)
}

/// The range from `low` to `high` in steps of `scale` from `origin`, rounded outwards.
fn quantised(low: f32, high: f32, origin: f32, scale: f32) -> [u32; 2] {
    let steps = |x: f32| ((x - origin) / scale).clamp(0.0, 255.0);
    let (mut low_step, mut high_step) = (steps(low).floor(), steps(high).ceil());
    // Both the quotient here and the product in the shader are rounded, so the result is checked.
    if origin + low_step * scale > low {
        low_step -= 1.0;
    }
    if origin + high_step * scale < high {
        high_step += 1.0;
    }
    [low_step.clamp(0.0, 255.0) as u32, high_step.clamp(0.0, 255.0) as u32]
}
