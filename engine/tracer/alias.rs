//! Alias tables (Walker 1977; Vose 1991): they draw a column in proportion to its weight with two random numbers.

use crate::shaders::types::AliasEntry;

/// A table over `weights`, which must not be negative. If no weight is positive, all columns have the same probability. Without weights the
/// table has one column.
pub fn table(weights: &[f64]) -> Vec<AliasEntry> {
    let n = weights.len().max(1);
    let clean = |w: f64| if w.is_finite() { w.max(0.0) } else { 0.0 };
    let total: f64 = weights.iter().map(|&w| clean(w)).sum();
    if total <= 0.0 {
        return (0..n).map(|i| AliasEntry { keep: 1.0, other: i as u32, probability: 1.0 / n as f32 }).collect();
    }
    let shares: Vec<f64> = weights.iter().map(|&w| clean(w) / total).collect();
    let mut columns: Vec<AliasEntry> = shares
        .iter()
        .enumerate()
        .map(|(i, &p)| AliasEntry { keep: 1.0, other: i as u32, probability: p as f32 })
        .collect();
    let mut heights: Vec<f64> = shares.iter().map(|p| p * n as f64).collect();
    let (mut low, mut high): (Vec<usize>, Vec<usize>) = (0..n).partition(|&i| heights[i] < 1.0);
    while let (Some(&poor), Some(&rich)) = (low.last(), high.last()) {
        low.pop();
        columns[poor].keep = heights[poor] as f32;
        columns[poor].other = rich as u32;
        heights[rich] -= 1.0 - heights[poor];
        if heights[rich] < 1.0 {
            high.pop();
            low.push(rich);
        }
    }
    // The remaining columns have a share of 1, up to rounding. A column of weight 0 must not become drawable by rounding.
    let fullest = (0..n).max_by(|&a, &b| shares[a].total_cmp(&shares[b])).unwrap_or(0);
    for i in low.into_iter().chain(high) {
        if shares[i] == 0.0 {
            columns[i].keep = 0.0;
            columns[i].other = fullest as u32;
        }
    }
    columns
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The probability of each entry, summed over the columns.
    fn amounts(columns: &[AliasEntry]) -> Vec<f64> {
        let mut out = vec![0.0; columns.len()];
        for (i, column) in columns.iter().enumerate() {
            let keep = f64::from(column.keep);
            out[i] += keep / columns.len() as f64;
            out[column.other as usize] += (1.0 - keep) / columns.len() as f64;
        }
        out
    }

    proptest! {
        #[test]
        fn columns_amount_to_the_weights(weights in prop::collection::vec(prop_oneof![Just(0.0), 1e-6f64..1e6], 1..200)) {
            let columns = table(&weights);
            let total: f64 = weights.iter().sum();
            for ((weight, amount), column) in weights.iter().zip(amounts(&columns)).zip(&columns) {
                let want = if total > 0.0 { weight / total } else { 1.0 / weights.len() as f64 };
                prop_assert!((amount - want).abs() < 1e-6, "{amount} instead of {want}");
                prop_assert!((f64::from(column.probability) - want).abs() < 1e-6);
                prop_assert!(want > 0.0 || amount == 0.0);
            }
        }
    }

    #[test]
    fn odd_weights_do_no_harm() {
        assert_eq!(table(&[]).len(), 1);
        assert_eq!(table(&[0.0, 0.0])[1].probability, 0.5);
        let columns = table(&[f64::NAN, 1.0, f64::INFINITY, -3.0]);
        assert_eq!(columns[1].probability, 1.0);
        assert_eq!(columns[0].other, 1);
    }
}
