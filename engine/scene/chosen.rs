//! Objects of a scene, chosen by the names of their nodes or of their materials.

use super::Scene;
use crate::{Error, Result};

/// Names of an error's list at most.
const LISTED: usize = 12;

/// The surfaces of some nodes, with those of the nodes below them, and of some materials.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Chosen {
    /// For each of [`Scene::nodes`].
    nodes: Vec<bool>,
    /// For each of [`Scene::materials`].
    materials: Vec<bool>,
}

impl Chosen {
    /// The nodes and materials with these names. `names` has commas between the names, whose outer spaces do not count. All nodes and materials
    /// of one name are chosen. A name that has a comma itself may be the only one.
    ///
    /// # Errors
    /// `Usage` if there is no name in `names`, and if no node or material has one of the names, with the names that there are.
    pub fn by_names(scene: &Scene, names: &str) -> Result<Self> {
        let mut chosen = Self { nodes: vec![false; scene.nodes.len()], materials: vec![false; scene.materials.len()] };
        if chosen.add(scene, names.trim()) {
            chosen.inherit(scene);
            return Ok(chosen);
        }
        let list: Vec<&str> = names.split(',').map(str::trim).filter(|name| !name.is_empty()).collect();
        if list.is_empty() {
            return Err(Error::usage(format!("'{names}' has no name"))
                .help("Names of nodes or materials, with commas between them"));
        }
        for name in list {
            if !chosen.add(scene, name) {
                return Err(unknown(scene, name));
            }
        }
        chosen.inherit(scene);
        Ok(chosen)
    }

    /// Whether a surface of this material at this node is chosen.
    pub fn has(&self, node: u32, material: u32) -> bool {
        let is = |list: &[bool], at: u32| list.get(at as usize).copied().unwrap_or(false);
        is(&self.nodes, node) || is(&self.materials, material)
    }

    /// Chooses all that have a name. False: nothing has it.
    fn add(&mut self, scene: &Scene, name: &str) -> bool {
        let mut found = false;
        let nodes = self.nodes.iter_mut().zip(scene.nodes.iter().map(|node| &node.name));
        let materials = self.materials.iter_mut().zip(scene.materials.iter().map(|material| &material.name));
        for (chosen, _) in nodes.chain(materials).filter(|(_, own)| !name.is_empty() && own.trim() == name) {
            *chosen = true;
            found = true;
        }
        found
    }

    /// Chooses the nodes below chosen nodes. Parents come before their children.
    fn inherit(&mut self, scene: &Scene) {
        for (at, node) in scene.nodes.iter().enumerate() {
            self.nodes[at] |= node.parent.is_some_and(|parent| self.nodes[parent as usize]);
        }
    }
}

fn unknown(scene: &Scene, name: &str) -> Error {
    let listed = |names: Vec<&str>| {
        let mut names: Vec<&str> = names.into_iter().filter(|name| !name.is_empty()).collect();
        names.sort_unstable();
        names.dedup();
        let more = if names.len() > LISTED { format!(", and {} more", names.len() - LISTED) } else { String::new() };
        let some = names.iter().take(LISTED).map(|name| format!("'{name}'")).collect::<Vec<_>>().join(", ");
        if some.is_empty() { "none with a name".to_owned() } else { format!("{some}{more}") }
    };
    let nodes = listed(scene.nodes.iter().map(|node| node.name.as_str()).collect());
    let materials = listed(scene.materials.iter().map(|material| material.name.as_str()).collect());
    Error::usage(format!("no node and no material of the scene is named '{name}'"))
        .help(format!("Nodes: {nodes}. Materials: {materials}. `lucerna inspect --json` lists all"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Material, Node};

    fn scene() -> Scene {
        let node = |name: &str, parent| Node { name: name.into(), parent, ..Node::default() };
        let material = |name: &str| Material { name: name.into(), ..Material::default() };
        Scene {
            nodes: vec![
                node("hero", None),
                node("arm", Some(0)),
                node("hand", Some(1)),
                node("wall, left", None),
                node("", None),
            ],
            materials: vec![material("gold"), material("hero")],
            ..Scene::default()
        }
    }

    #[test]
    fn a_node_brings_those_below_it_and_materials_count_too() {
        let scene = scene();
        let arm = Chosen::by_names(&scene, " arm ,gold").unwrap();
        assert_eq!([0, 1, 2, 3].map(|node| arm.has(node, 1)), [false, true, true, false]);
        assert!(arm.has(3, 0) && !arm.has(9, 9));
        // A name of a node and of a material is both; one with a comma is found if it stands alone.
        let hero = Chosen::by_names(&scene, "hero").unwrap();
        assert!(hero.has(2, 0) && hero.has(3, 1) && !hero.has(3, 0));
        assert!(Chosen::by_names(&scene, "wall, left").unwrap().has(3, 0));
        assert!(
            ["", " , "]
                .iter()
                .all(|none| Chosen::by_names(&scene, none).unwrap_err().to_string().contains("has no name"))
        );
    }

    #[test]
    fn an_unknown_name_is_an_error_that_lists_names() {
        let error = Chosen::by_names(&scene(), "hero,heroine").unwrap_err();
        assert_eq!(error.exit_code(), 2);
        let text = error.to_string();
        for part in ["'heroine'", "'arm', 'hand', 'hero', 'wall, left'", "'gold', 'hero'"] {
            assert!(text.contains(part), "{text}");
        }
        assert!(Chosen::by_names(&Scene::default(), "x").unwrap_err().to_string().contains("none with a name"));
    }
}
