//! Tasks finish in another order on every machine. Were a sum taken in the order of arrival, or a packing seeded by a
//! worker, the same input would give other digits on another number of threads, and nobody could check a result.

use tests::history;
use tests::inputs;
use tests::ordeal::Ordeal;
use tests::workplace::Workplace;

fn assert_same_on_any_number_of_threads(input: &str) {
    let histories = [1, 2, 4].map(|threads| {
        let place = Workplace::new();
        let input = place.write("small.yaml", input);
        Ordeal {
            input: &input,
            run: "small",
            threads,
        }
        .arrive(&place);
        history::of(&place.store(), "small").unwrap()
    });
    assert!(histories[0].steps.len() > 4);
    assert_eq!(histories[0], histories[1]);
    assert_eq!(histories[0], histories[2]);
}

#[test]
fn one_two_and_four_threads_give_the_same_bits() {
    assert_same_on_any_number_of_threads(&inputs::biaxial("small", 100, 8));
}

#[test]
fn also_where_steps_are_cut() {
    assert_same_on_any_number_of_threads(&inputs::biaxial_with_cuts("small", 60, 4));
}

#[test]
fn the_digest_tells_one_input_from_another() {
    let digests = [40, 41].map(|grains| {
        let place = Workplace::new();
        let input = place.write("small.yaml", &inputs::biaxial("small", grains, 1));
        Ordeal {
            input: &input,
            run: "small",
            threads: 2,
        }
        .arrive(&place);
        history::of(&place.store(), "small")
            .unwrap()
            .steps
            .last()
            .copied()
            .unwrap()
    });
    assert_ne!(digests[0], digests[1]);
}
