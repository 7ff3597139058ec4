//! The search by its definition, for tests of the fast one.

use super::{Candidates, Metric, NONE, Queries, ReferenceSet};

/// All distances to what has the query's sign, sorted; equal ones in the order of faces and references.
pub fn candidates<'a>(
    metric: Metric,
    length: usize,
    faces: &[ReferenceSet],
    queries: impl Into<Queries<'a>>,
    k: usize,
) -> Candidates {
    let mut found = Candidates {
        k,
        ..Candidates::default()
    };
    let queries = queries.into();
    for (i, query) in queries.descriptors.chunks_exact(length).enumerate() {
        let sign = queries.signs.map_or(0, |signs| signs[i]);
        let mut all: Vec<(f32, u32, u32)> = Vec::new();
        for (number, face) in faces.iter().enumerate() {
            let signs = face.signs();
            for (i, reference) in face.descriptors().chunks_exact(length).enumerate() {
                if signs[i] == sign {
                    all.push((distance(metric, query, reference), number as u32, i as u32));
                }
            }
        }
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        found.ratio.push(ratio(faces, &all));
        all.resize(k.max(all.len()), (f32::INFINITY, NONE, NONE));
        for neighbour in &all[..k] {
            found.distance.push(neighbour.0);
            found.face.push(neighbour.1);
            found.reference.push(neighbour.2);
        }
    }
    found
}

fn ratio(faces: &[ReferenceSet], sorted: &[(f32, u32, u32)]) -> f32 {
    let Some(&(nearest, face, reference)) = sorted.first() else {
        return f32::INFINITY;
    };
    let place = faces[face as usize].points()[reference as usize];
    let elsewhere = sorted.iter().find(|&&(_, other, i)| {
        let there = faces[other as usize].points()[i as usize];
        let apart = (place[0] - there[0]).hypot(place[1] - there[1]);
        other != face || apart > faces[face as usize].radius()
    });
    match elsewhere {
        None => 0.0,
        Some(&(0.0, ..)) => 1.0,
        Some(&(distance, ..)) => nearest / distance,
    }
}

fn distance(metric: Metric, a: &[u8], b: &[u8]) -> f32 {
    let pairs = a.iter().zip(b);
    match metric {
        Metric::Euclidean => {
            let sum: u32 = pairs.map(|(a, b)| u32::from(a.abs_diff(*b)).pow(2)).sum();
            (sum as f32).sqrt()
        }
        Metric::Hamming => pairs.map(|(a, b)| (a ^ b).count_ones()).sum::<u32>() as f32,
    }
}
