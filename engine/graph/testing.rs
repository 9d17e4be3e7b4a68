//! Checks for the graphs that techniques build; no device is needed.

use super::{Graph, Plan, oracle};

/// Plans `graph`, has the plan checked by the [`oracle`], and drops each barrier in turn, to which the oracle must object.
///
/// # Panics
/// If the graph has mistakes, the plan is wrong, or a barrier could be dropped.
#[track_caller]
pub fn every_barrier_matters(graph: &Graph) -> Plan {
    let plan = match Plan::new(graph) {
        Ok(plan) => plan,
        Err(mistakes) => {
            let lines: Vec<String> = mistakes.iter().map(ToString::to_string).collect();
            panic!("{} mistakes:\n{}", lines.len(), lines.join("\n"));
        }
    };
    let objections = oracle::check(&plan);
    assert!(objections.is_empty(), "the plan of `{}` is wrong:\n{}", graph.name(), objections.join("\n"));
    for i in 0..plan.barriers.len() {
        let objections = oracle::check_one(&plan.without_barrier(i), plan.barriers[i].physical);
        assert!(!objections.is_empty(), "nobody misses barrier {i} of `{}`: {:?}", graph.name(), plan.barriers[i]);
    }
    plan
}
