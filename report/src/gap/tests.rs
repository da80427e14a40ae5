use sim_to_real::{Answer, Findings};

use super::examples::{answer, cells, findings, ground, left, strip};
use super::{
    Pictures, Reference, ground as ground_page, heldout as heldout_page, pictures, places, residuals,
    throughout,
};

#[test]
fn every_page_is_drawn_when_there_is_something_on_it() {
    let (findings, cells, ground, strip) = (findings(), cells(), ground(), strip());
    let answer = Answer { left: left(), ..answer() };
    let pictures = Pictures {
        reference: Reference::Simulator,
        answer: &answer,
        findings: &findings,
        heldout_residuals: &cells,
        ground: Some(&ground),
        heldout: Some(&strip),
    };
    let drawn = super::pictures(&pictures).unwrap();
    let files: Vec<_> = drawn.iter().map(|picture| picture.file).collect();
    assert_eq!(
        files,
        [
            "ranking.png",
            "throughout.png",
            "places.png",
            "left.png",
            "swing.png",
            "residuals.png",
            "ground.png",
            "heldout.png"
        ]
    );
    for picture in &drawn {
        // PNG's signature, then IHDR with the width as the first number.
        assert_eq!(&picture.png[..8], b"\x89PNG\r\n\x1a\n", "{}", picture.file);
        assert_eq!(picture.png[16..20], 1600_u32.to_be_bytes(), "{}", picture.file);
    }
}

#[test]
fn pages_without_anything_on_them_are_left_out() {
    let empty = Answer { ranking: Vec::new(), by_part: Vec::new(), ..answer() };
    let nothing = Pictures {
        reference: Reference::Bicycle,
        answer: &empty,
        findings: &Findings::default(),
        heldout_residuals: &[],
        ground: None,
        heldout: None,
    };
    assert!(pictures(&nothing).unwrap().is_empty());
    let only_heldout = Pictures { heldout_residuals: &cells(), ..nothing };
    assert_eq!(pictures(&only_heldout).unwrap()[0].file, "residuals.png");
}

/// Where what is announced is all of the gap, its shares have a bar of their own and order the rows: the heading explains 0.7
/// through it here and stands above the change of steering, which explains most of the residual itself.
#[test]
fn places_are_ordered_by_what_is_announced() {
    let (answer, mut findings) = (answer(), findings());
    findings.conditions[3].announced_share = Some(0.7);
    let page = |findings: &Findings| {
        let pictures = Pictures {
            reference: Reference::Simulator,
            answer: &answer,
            findings,
            heldout_residuals: &[],
            ground: None,
            heldout: None,
        };
        places::page(&pictures).unwrap().svg()
    };
    let comes_first = |page: &str| page.find("heading").unwrap() < page.find("change of steering").unwrap();
    let told = page(&findings);
    assert!(told.contains("through what is announced") && comes_first(&told));
    findings.conditions.iter_mut().for_each(|table| table.announced_share = None);
    let without = page(&findings);
    assert!(!without.contains("through what is announced") && !comes_first(&without));
}

/// Without nominal drives no page may speak of them.
#[test]
fn pages_name_what_the_drives_were_held_against() {
    let (answer, findings, cells, strip) = (answer(), findings(), cells(), strip());
    let told = |reference: Reference| {
        let pictures = Pictures {
            reference,
            answer: &answer,
            findings: &findings,
            heldout_residuals: &cells,
            ground: None,
            heldout: Some(&strip),
        };
        let pages = [places::page(&pictures), residuals::page(&pictures), ground_page::page(&pictures)];
        let pages = pages.into_iter().flatten().chain([heldout_page::page(&strip, reference)]);
        pages.map(|page| page.svg()).collect::<String>() + &reference.places()
    };
    let (simulator, bicycle) = (told(Reference::Simulator), told(Reference::Bicycle));
    assert!(simulator.contains("calibrated nominal model") && simulator.contains("floor: nominal drives"));
    assert!(bicycle.contains("kinematic bicycle") && !bicycle.contains("nominal"), "{bicycle}");
}

#[test]
fn numbers_that_are_none_do_not_reach_the_page() {
    let mut findings = findings();
    findings.conditions[0].share = f64::NAN;
    findings.residuals[0].before = f64::INFINITY;
    findings.map[0].before = f64::NAN;
    let mut answer = Answer { left: left(), ..answer() };
    answer.left[0].bins[0].mean = f64::NAN;
    answer.by_part[0].estimate.value = f64::NAN;
    answer.by_part[1].estimate.high = f64::INFINITY;
    let pictures = Pictures {
        reference: Reference::Simulator,
        answer: &answer,
        findings: &findings,
        heldout_residuals: &[],
        ground: None,
        heldout: None,
    };
    let [places, residuals, ground] =
        [places::page(&pictures), residuals::page(&pictures), ground_page::page(&pictures)]
            .map(|page| page.unwrap().svg());
    let throughout = throughout::page(&answer).unwrap().svg();
    let left = super::left::page(&answer, Reference::Simulator).unwrap().svg();
    for page in [places, residuals, ground, throughout, left] {
        assert!(!page.contains("NaN") && !page.contains("inf\""), "a number that is none");
    }
}
