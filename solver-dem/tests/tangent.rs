//! A wrong tangent is not seen in any stress, it only makes Newton slow or lets it fail: it is compared with
//! finite differences of the response itself.

mod common;

use common::{SHEARED, SMALL, relative, tight};
use solver_dem::{
    Rev, respond,
    tensor::{Tensor2, Tensor4, product},
};

const STEP: f64 = 1e-7;

/// ∂σ_ij/∂L_kl with F → (1 + L)·F, by central differences.
fn differences(rev: &Rev<2, 1>, f: &Tensor2<2>) -> Tensor4<2> {
    let mut c = [[[[0.0; 2]; 2]; 2]; 2];
    for k in 0..2 {
        for l in 0..2 {
            let stress = |sign: f64| {
                let mut g = common::UNIT;
                g[k][l] += sign * STEP;
                respond(rev, None, &product(&g, f), &tight())
                    .unwrap()
                    .stress
            };
            let (up, down) = (stress(1.0), stress(-1.0));
            for i in 0..2 {
                for j in 0..2 {
                    c[i][j][k][l] = (up[i][j] - down[i][j]) / (2.0 * STEP);
                }
            }
        }
    }
    c
}

#[test]
fn algorithmic_tangent_is_the_derivative_of_the_response() {
    let shortening = [[1.0 + 1e-4, 1e-5], [-1e-5, 1.0 - 3e-4]];
    for (name, rev) in [("isotropic", &*SMALL), ("0.3 %", &*SHEARED)] {
        let response = respond(rev, None, &shortening, &tight()).unwrap();
        assert!(!response.report.affine_tangent);
        let error = relative(&response.tangent, &differences(rev, &shortening));
        assert!(error < 5e-5, "{name}: {error:e}");
        // Sliding makes the difference, or the test would say nothing about it.
        assert!(response.report.sliding >= 5, "{name}");
        assert!(relative(&response.elastic_tangent, &response.tangent) > 1e-2);
    }
}

/// With unbounded friction every contact of the end state sticks, which is what the elastic tangent assumes.
#[test]
fn elastic_tangent_is_the_derivative_with_all_contacts_sticking() {
    for rev in [&*SMALL, &*SHEARED] {
        let mut sticky = rev.clone();
        sticky.law.friction = 1e6;
        let response = respond(&sticky, None, &common::UNIT, &tight()).unwrap();
        sticky.state = response.state;
        let error = relative(
            &response.elastic_tangent,
            &differences(&sticky, &common::UNIT),
        );
        assert!(error < 1e-4, "{error:e}");
    }
}
