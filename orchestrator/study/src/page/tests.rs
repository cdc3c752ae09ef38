use super::*;

fn judged(verdict: Verdict) -> Judged {
    Judged { verdict, checks: Vec::new() }
}

#[test]
fn the_answer_is_a_sentence() {
    use Verdict::{DoesNotHold, Holds, HoldsPartly};
    let answer = |verdicts: &[Verdict]| {
        super::answer(&verdicts.iter().map(|verdict| judged(*verdict)).collect::<Vec<_>>())
    };
    assert_eq!(answer(&[Holds]), "The claim holds.");
    assert_eq!(answer(&[Holds, Holds]), "All 2 claims hold.");
    let mixed = [Holds, Holds, HoldsPartly, DoesNotHold];
    assert_eq!(answer(&mixed), "Of 4 claims, 2 hold, 1 holds in part, 1 does not hold.");
}
