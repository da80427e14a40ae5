use super::*;
use crate::gap::examples::answer;

fn shown(answer: &Answer) -> String {
    let pictures =
        [Picture { file: "places.png", caption: "where \"it\" is".to_owned(), png: vec![1, 2, 3] }];
    let doubts = ["d.csv: gap of 1 s".to_owned()];
    page(&Page {
        answer,
        drives: "v: 4 nominal drives",
        doubts: &doubts,
        pictures: &pictures,
        reference: Reference::Simulator,
        program: "surefoot 1",
    })
}

#[test]
fn the_page_holds_the_answer_and_nothing_from_elsewhere() {
    let html = shown(&answer());
    for part in [
        "The gap comes from steer_lag.",
        "time constant 0.210 s (0.180 to 0.240)",
        "change of steering 0.61",
        "97 % (90 to 100 %) of the gap closes on the held-out drives",
        "predicted from the real drives alone: 95 % of the gap closes",
        "position error after 2 s 0.289 m before, 0.101 m after",
        "yaw [rad]</td><td>0.0210 to 0.00400 (floor 0.00300)",
        "d.csv: gap of 1 s",
        // Base64 of the bytes 1, 2, 3.
        "data:image/png;base64,AQID\"",
    ] {
        assert!(html.contains(part), "{part} is missing in {html}");
    }
    assert!(!html.contains("http") && !html.contains("<script"), "{html}");
}

#[test]
fn markup_in_names_is_text() {
    let html = shown(&answer());
    assert!(
        html.contains("<h1>steering &lt;late&gt;</h1>") && html.contains("steps of the steering &amp; sines")
    );
    assert!(html.contains("alt=\"where &quot;it&quot; is\""), "{html}");
}

#[test]
fn none_and_unknown_are_told_without_effects() {
    let none = Answer { verdict: Verdict::None, effects: Vec::new(), credible_set: Vec::new(), ..answer() };
    let html = shown(&none);
    assert!(html.contains("No gap: ") && html.contains("Without a gap there is no place."), "{html}");
    assert!(!html.contains("<table>"), "{html}");
    let unknown = Answer { verdict: Verdict::Unknown, ..none };
    assert!(shown(&unknown).contains("nothing that the catalogue knows explains it"));
}

/// Of several effects together no one explains the drives alone, and nothing may say so.
#[test]
fn what_else_would_explain_the_drives_depends_on_how_many_effects_are_announced() {
    let one = answer();
    assert!(shown(&one).contains("Alone, these explain the drives about as well: <code>steer_delay</code>"));
    let twice = [one.effects.clone(), one.effects.clone()].concat();
    let two = Answer { effects: twice, ..one };
    assert!(
        shown(&two).contains("In place of one of them, these would do as well: <code>steer_delay</code>")
    );
    let none_other = Answer { credible_set: vec!["steer_lag".to_owned()], ..two };
    assert!(!shown(&none_other).contains("as well:"));
}
