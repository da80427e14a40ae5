//! A diagnosis in plain words.

use super::in_simulator::in_simulator;
use super::words;
use bicycle::effect::{CATALOGUE, Parameter};
use sim_to_real::{
    Answer, Condition, Estimate, Leaning, LeftBin, LeftOver, NamedEffect, PoseSensor, Shrink, Swing,
    SwingOver, Verdict,
};

/// The verdict in a sentence.
pub(crate) fn verdict(answer: &Answer) -> String {
    let names = listed(&answer.effects.iter().map(|effect| effect.id.as_str()).collect::<Vec<_>>());
    match answer.verdict {
        Verdict::None => {
            "No gap: the real drives differ from the simulator by no more than its own drives from one another."
                .to_owned()
        }
        Verdict::Effects => format!("The gap comes from {names}."),
        Verdict::EffectsAndUnknown => {
            format!("A part of the gap comes from {names}; the rest is nothing that the catalogue knows.")
        }
        Verdict::Unknown => "There is a gap, and nothing that the catalogue knows explains it.".to_owned(),
    }
}

/// `a`, `a and b`, `a, b and c`.
pub(super) fn listed(names: &[&str]) -> String {
    match names {
        [all @ .., last] if !all.is_empty() => format!("{} and {last}", all.join(", ")),
        _ => names.concat(),
    }
}

/// The catalogue's effect that was found: the cause itself, or another form of it.
pub(super) fn found(effect: &NamedEffect) -> &str {
    effect.form.as_deref().unwrap_or(&effect.id)
}

/// What an effect is, from the catalogue.
pub(crate) fn meaning(effect: &NamedEffect) -> &'static str {
    let description = CATALOGUE.iter().find(|description| description.id == found(effect));
    description.map_or("", |description| description.meaning)
}

/// Parameters with values and intervals: `time_constant 0.210 s (0.180 to 0.240)`.
pub(crate) fn parameters(effect: &NamedEffect) -> String {
    let told = |(name, estimate): (&String, &Estimate)| parameter(found(effect), name, estimate);
    effect.parameters.iter().map(told).collect::<Vec<_>>().join(", ")
}

/// One parameter with value, unit and 90 % interval.
pub(crate) fn parameter(id: &str, name: &str, estimate: &Estimate) -> String {
    let known = CATALOGUE.iter().find(|description| description.id == id);
    let known = known.and_then(|description| description.parameters.iter().find(|p| p.name == name));
    let unit = known.map_or("", |parameter: &Parameter| parameter.unit);
    let unit = if unit == "-" || unit.is_empty() { String::new() } else { format!(" {unit}") };
    let Estimate { value, low, high } = *estimate;
    format!("{} {}{unit} ({} to {})", plain_name(name), rounded(value), rounded(low), rounded(high))
}

/// `time_constant_s` without its unit and underscores.
fn plain_name(name: &str) -> String {
    let units = ["_s", "_rad", "_mps", "_mps2", "_radps", "_per_m", "_m", "_s2_per_m", "_s2_per_m2"];
    let longest = units.iter().filter_map(|unit| name.strip_suffix(unit)).min_by_key(|rest| rest.len());
    longest.unwrap_or(name).replace('_', " ")
}

/// Three significant digits.
pub(super) fn rounded(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        // Without the sign of a negative zero.
        return format!("{}", value + 0.0);
    }
    let decimals = (2 - value.abs().log10().floor() as i32).clamp(0, 6) as usize;
    format!("{value:.decimals$}")
}

/// A condition in words.
pub(crate) fn condition(condition: Condition) -> &'static str {
    match condition {
        Condition::Speed => "speed",
        Condition::Steering => "steering",
        Condition::SteeringChange => "change of steering",
        Condition::SpeedChange => "change of speed",
        Condition::LateralAcceleration => "lateral acceleration",
        Condition::Pitch => "pitch of the ground",
        Condition::Roll => "roll of the ground",
        Condition::TerrainClass => "terrain class",
        Condition::Heading => "heading",
        Condition::Constant => "everywhere the same",
        Condition::Time => "time",
    }
}

/// Share above the null from which a condition is told [-].
pub(crate) const STANDS_OUT: f64 = 0.01;

/// The conditions that stand out, as `speed 0.61, pitch 0.12`.
pub(crate) fn places(answer: &Answer) -> String {
    let standing = answer.places.iter().filter(|place| place.share > STANDS_OUT);
    let told: Vec<_> =
        standing.map(|place| format!("{} {:.2}", condition(place.condition), place.share)).collect();
    if told.is_empty() { "nowhere in particular".to_owned() } else { told.join(", ") }
}

/// What the announced effects leave, line by line: where it is least and where it is most.
pub(crate) fn left(answer: &Answer) -> Vec<String> {
    let told = |shape: &LeftOver| {
        let by_mean = |a: &&LeftBin, b: &&LeftBin| a.mean.total_cmp(&b.mean);
        let [least, most] = [shape.bins.iter().min_by(by_mean)?, shape.bins.iter().max_by(by_mean)?];
        let (name, unit) = words::condition(shape.condition);
        let at = |bin: &LeftBin| match shape.condition {
            Condition::TerrainClass => format!("on class {:.0}", 0.5 * (bin.low + bin.high)),
            Condition::Time => format!("at {:.0} to {:.0} % of it", 100.0 * bin.low, 100.0 * bin.high),
            _ => format!("at {} to {} {unit}", rounded(bin.low), rounded(bin.high)),
        };
        let mean = |bin: &LeftBin| format!("{} {}", rounded(bin.mean), shape.quantity.unit());
        let off = match shape.condition {
            Condition::Constant => format!(": off by {} everywhere", mean(least)),
            _ => format!(", by {name}: off by {} {}, by {} {}", mean(least), at(least), mean(most), at(most)),
        };
        let (quantity, percent) = (words::state(shape.quantity), 100.0 * shape.share);
        Some(format!("{quantity}{off} ({percent:.0} % of what is left, {} s ahead)", shape.horizon_s))
    };
    let of_body = answer.leaning.iter().map(leaning).chain(answer.swing.iter().map(swing));
    let all: Vec<String> = of_body.chain(answer.left.iter().filter_map(told)).collect();
    let is_unknown = matches!(answer.verdict, Verdict::Unknown | Verdict::EffectsAndUnknown);
    if is_unknown && all.is_empty() {
        return vec!["nothing that follows a condition or the time".to_owned()];
    }
    all
}

fn leaning(found: &Leaning) -> String {
    let way = |angle_rad: f64, [positive, negative]: [&str; 2]| {
        let side = if angle_rad > 0.0 { positive } else { negative };
        (angle_rad != 0.0).then(|| format!("{:.2} deg further {side}", angle_rad.abs().to_degrees()))
    };
    let ways = [
        way(found.pitch_rad, ["nose down", "nose up"]),
        way(found.roll_rad, ["to the right", "to the left"]),
    ];
    let ways: Vec<String> = ways.into_iter().flatten().collect();
    format!(
        "the body leans {} than the simulator's on the same ground under the same accelerations, in every drive: a \
         spring, a load, a pull, or how the sensor is mounted",
        ways.join(" and ")
    )
}

fn swing(found: &Swing) -> String {
    let how = match found.over {
        SwingOver::Time => format!("{:.2} times a second", found.frequency),
        SwingOver::Way => format!(
            "once every {:.3} m, as often as a wheel with a radius of {:.3} m turns",
            1.0 / found.frequency,
            1.0 / (std::f64::consts::TAU * found.frequency)
        ),
    };
    format!(
        "the yaw rate swings {how}, by {} rad/s either way, in every drive, whatever is commanded; the simulator's does not",
        rounded(found.amplitude_radps)
    )
}

/// How far the gap shrinks, line by line.
pub(crate) fn shrink(shrink: &Shrink) -> Vec<String> {
    let mut lines = Vec::new();
    if let Some(predicted) = shrink.predicted_closed {
        lines.push(format!(
            "predicted from the real drives alone: {:.0} % of the gap closes",
            100.0 * predicted
        ));
    }
    match (shrink.before, shrink.after) {
        (Some(before), Some(after)) => lines.push(format!(
            "held-out rollout error {before:.2} before, {after:.2} after, {:.2} is the floor",
            shrink.floor
        )),
        _ => lines.push("no held-out drives: nothing was verified".to_owned()),
    }
    lines.extend(closed(shrink));
    if let Some(error) = shrink.position_error_2s_m {
        lines.push(format!(
            "position error after 2 s {:.3} m before, {:.3} m after",
            error.before, error.after
        ));
    }
    lines.extend(shrink.learned_bound_closed.map(|bound| learned(bound, shrink.closed)));
    lines
}

/// Errors of all quantities after the last horizon, in their own units.
fn in_units(answer: &Answer) -> Option<String> {
    let last_s = answer.errors_by_quantity.iter().map(|error| error.horizon_s).fold(0.0, f64::max);
    let last = answer.errors_by_quantity.iter().filter(|error| error.horizon_s == last_s);
    let told: Vec<String> = last
        .map(|error| {
            let [before, after] = [error.before, error.after].map(rounded);
            format!("{} {before} to {after} {}", words::state(error.quantity), error.unit)
        })
        .collect();
    (!told.is_empty()).then(|| format!("error after {last_s} s: {}", told.join(", ")))
}

/// What a learned correction on top of the announced effects adds.
fn learned(bound: f64, closed: Option<f64>) -> String {
    let percent = 100.0 * bound;
    if closed.is_some_and(|closed| bound > closed + MORE) {
        return format!(
            "with a learned correction on top {percent:.0} %: so much a flexible model finds beyond them"
        );
    }
    format!("a learned correction on top finds nothing to add ({percent:.0} %)")
}

/// Closed part by which a learned correction has to surpass the announced effects to have found anything [-].
const MORE: f64 = 0.01;

pub(super) fn closed(shrink: &Shrink) -> Option<String> {
    let before = shrink.before?;
    let Some(closed) = shrink.closed else {
        return (before < 1.2 * shrink.floor)
            .then(|| "so near to the floor that there is nothing to close".to_owned());
    };
    let interval = shrink.closed_low.zip(shrink.closed_high);
    let interval = interval
        .map(|(low, high)| format!(" ({:.0} to {:.0} %)", 100.0 * low, 100.0 * high))
        .unwrap_or_default();
    Some(format!("{:.0} %{interval} of the gap closes on the held-out drives", 100.0 * closed))
}

/// Everything for the terminal.
pub fn text(answer: &Answer, drives: &str) -> String {
    let mut lines = vec![String::new(), format!("  {} · {drives}", answer.case), String::new()];
    lines.push(format!("  {}", verdict(answer)));
    for effect in &answer.effects {
        lines.push(format!("    {}  {}", effect.id, parameters(effect)));
        lines.push(format!("      {}", meaning(effect)));
        lines.extend(asked_for(answer, &effect.id).map(|told| format!("      {told}")));
    }
    if matches!(answer.verdict, Verdict::Effects | Verdict::EffectsAndUnknown) {
        lines.extend(others(answer).map(|(what, names)| format!("    {what}: {}", names.join(", "))));
    }
    lines.extend(answer.pose_sensor.iter().map(|found| format!("  pose     {}", pose_sensor(found))));
    if answer.verdict != Verdict::None {
        lines.push(format!("  where    {}", places(answer)));
    }
    lines.extend(named("left", &left(answer)));
    let how_far = shrink(&answer.shrink).into_iter().chain(in_units(answer)).collect::<Vec<_>>();
    lines.extend(named("how far", &how_far));
    lines.extend(answer.in_simulator.iter().flat_map(|own| named("yours", &in_simulator(own))));
    lines.extend(named("next", &answer.advice));
    lines.join("\n") + "\n"
}

/// What was found of the robot's pose sensor, and taken out.
pub(crate) fn pose_sensor(found: &PoseSensor) -> String {
    let of = |before: &str, estimate: Option<Estimate>, after: &str| {
        let Estimate { value, low, high } = estimate?;
        let unit = if after.is_empty() { "s" } else { "m" };
        Some(format!("{before} {value:.3} {unit} ({low:.3} to {high:.3}){after}"))
    };
    let told = [
        of("is late by", found.time_offset_s, ""),
        of("sits", found.lever_arm_ahead_m, " ahead of the rear axle"),
        of("sits", found.lever_arm_left_m, " to its left"),
    ];
    let told: Vec<String> = told.into_iter().flatten().collect();
    let told: Vec<&str> = told.iter().map(String::as_str).collect();
    format!("The robot's pose sensor {}; taken out of its drives.", listed(&told))
}

/// Logarithm of how many times as probable an effect becomes by how the body leans, above which that is told.
const TOLD_OF_ATTITUDE: f64 = 1.0;

/// How strongly the drives ask for an effect, where that is known.
pub(crate) fn asked_for(answer: &Answer, id: &str) -> Option<String> {
    let support = answer.ranking.iter().find(|ranked| ranked.id == id)?.support?;
    let leans = match support.attitude {
        ..=TOLD_OF_ATTITUDE => String::new(),
        logarithm => format!("; how the body leans makes it {:.0} times as probable", logarithm.exp()),
    };
    Some(format!(
        "alone it is asked for {:.1} times as strongly as by chance, in every drive at least {:.1} times{leans}",
        support.strength, support.least_strength
    ))
}

/// What else would explain the gap: in which sense, and the names.
pub(crate) fn others(answer: &Answer) -> Option<(&'static str, Vec<&str>)> {
    let is_other = |id: &&String| answer.effects.iter().all(|effect| effect.id != **id);
    let others: Vec<&str> = answer.credible_set.iter().filter(is_other).map(String::as_str).collect();
    let what = match answer.effects.len() {
        1 => "Alone, these explain the drives about as well",
        _ => "In place of one of them, these would do as well",
    };
    (!others.is_empty()).then_some((what, others))
}

/// Lines below one another, the first with a name before it.
fn named(name: &str, lines: &[String]) -> Vec<String> {
    let name = |place: usize| if place == 0 { name } else { "" };
    lines.iter().enumerate().map(|(place, line)| format!("  {:<9}{line}", name(place))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gap::examples;

    #[test]
    fn the_answer_is_told_line_by_line() {
        let told = text(&examples::answer(), "v: 4 nominal drives");
        let lines: Vec<&str> = told.lines().map(str::trim_end).collect();
        let expected = [
            "",
            "  steering <late> · v: 4 nominal drives",
            "",
            "  The gap comes from steer_lag.",
            "    steer_lag  time constant 0.210 s (0.180 to 0.240)",
        ];
        assert_eq!(&lines[..5], expected);
        let strength = "      alone it is asked for 9.3 times as strongly as by chance, in every drive at least 8.1 times";
        assert_eq!(lines[6], strength);
        let rest = [
            "    Alone, these explain the drives about as well: steer_delay",
            "  where    change of steering 0.61",
            "  how far  predicted from the real drives alone: 95 % of the gap closes",
            "           held-out rollout error 2.10 before, 0.40 after, 0.35 is the floor",
            "           97 % (90 to 100 %) of the gap closes on the held-out drives",
            "           position error after 2 s 0.289 m before, 0.101 m after",
            "           error after 2 s: yaw 0.0210 to 0.00400 rad, displacement along 0.200 to 0.0500 m",
            "  next     drive steps of the steering & sines",
        ];
        assert_eq!(lines[7..], rest);
    }

    #[test]
    fn a_cause_is_told_by_the_form_that_was_found() {
        let estimate = Estimate { value: 0.0053, low: 0.003, high: 0.008 };
        let friction = |form: Option<&str>, name: &str| NamedEffect {
            id: "friction".to_owned(),
            form: form.map(str::to_owned),
            parameters: [(name.to_owned(), estimate)].into(),
        };
        let slip = friction(Some("tyre_slip"), "compliance_s2_per_m");
        assert!(meaning(&slip).starts_with("tyres that slip more: "), "{}", meaning(&slip));
        assert_eq!(parameters(&slip), "compliance 0.00530 s2/m (0.00300 to 0.00800)");
        let grip = friction(None, "mu");
        assert!(meaning(&grip).starts_with("friction: "), "{}", meaning(&grip));
    }

    #[test]
    fn what_is_left_is_told_by_its_ends() {
        let told = left(&Answer { left: examples::left(), ..examples::answer() });
        let expected = "yaw rate, by lateral acceleration: off by -0.0400 rad/s at -3.00 to -2.25 m/s², by 0.0300 rad/s at 2.25 to 3.00 m/s² (31 % of what is left, 1.2 s ahead)";
        assert_eq!(told[0], expected);
        let on_class = "forward speed, by terrain class: off by -0.300 m/s on class 2, by 0 m/s on class 0 (12 % of what is left, 1.2 s ahead)";
        assert_eq!(told[1], on_class);
        let mut sagging = examples::left();
        (sagging[0].condition, sagging[0].bins) = (Condition::Time, sagging[1].bins.clone());
        sagging[1].condition = Condition::Constant;
        (sagging[0].bins[0].low, sagging[0].bins[0].high) = (0.0, 0.125);
        let told = left(&Answer { left: sagging, ..examples::answer() });
        assert!(told[0].starts_with("yaw rate, by share of each drive: off by "), "{}", told[0]);
        assert!(told[0].contains("by 0 rad/s at 0 to 12 % of it"), "{}", told[0]);
        assert!(told[1].starts_with("forward speed: off by -0.300 m/s everywhere (12 %"), "{}", told[1]);
        assert!(left(&examples::answer()).is_empty());
        let shapeless = left(&Answer { verdict: Verdict::Unknown, ..examples::answer() });
        assert!(shapeless.len() == 1 && shapeless[0].starts_with("nothing that follows"), "{shapeless:?}");
    }

    #[test]
    fn what_leans_and_swings_is_told_with_its_size() {
        let leaning = Leaning { pitch_rad: 0.01, roll_rad: -0.02 };
        let swing = Swing { over: SwingOver::Way, frequency: 0.5, amplitude_radps: 0.02 };
        let of = |leaning, swing| Answer { leaning, swing, ..examples::answer() };
        let told = left(&of(Some(leaning), Some(swing)));
        assert!(
            told[0].contains("0.57 deg further nose down and 1.15 deg further to the left"),
            "{}",
            told[0]
        );
        assert!(
            told[1].contains("once every 2.000 m, as often as a wheel with a radius of 0.318 m"),
            "{}",
            told[1]
        );
        let told = left(&of(Some(Leaning { pitch_rad: -0.01, roll_rad: 0.0 }), None));
        assert!(told[0].contains("leans 0.57 deg further nose up than"), "{}", told[0]);
        let told = left(&of(None, Some(Swing { over: SwingOver::Time, ..swing })));
        assert!(told[0].contains("0.50 times a second, by 0.0200 rad/s"), "{}", told[0]);
    }

    #[test]
    fn a_pose_sensor_is_told_as_far_as_it_was_asked_about() {
        let time_offset_s = Some(Estimate { value: 0.12, low: 0.11, high: 0.1301 });
        let late = PoseSensor { time_offset_s, ..PoseSensor::default() };
        let arm = |value: f64| Some(Estimate { value, low: value - 0.1, high: value + 0.1 });
        let off = PoseSensor { lever_arm_ahead_m: arm(0.5), lever_arm_left_m: arm(-0.2), ..late };
        let told = pose_sensor(&off);
        let expected = "(0.110 to 0.130), sits 0.500 m (0.400 to 0.600) ahead of the rear axle and sits -0.200 m (-0.300 to -0.100) to its left; taken";
        assert!(told.contains(expected), "{told}");
        assert_eq!(
            pose_sensor(&late),
            "The robot's pose sensor is late by 0.120 s (0.110 to 0.130); taken out of its drives."
        );
    }

    #[test]
    fn a_parameter_is_told_with_unit_and_interval() {
        let estimate = Estimate { value: 0.2104, low: 0.18, high: 0.2399 };
        assert_eq!(
            parameter("steer_lag", "time_constant_s", &estimate),
            "time constant 0.210 s (0.180 to 0.240)"
        );
        let ratio = Estimate { value: 1.0, low: 0.95, high: 1.05 };
        assert_eq!(parameter("steer_gain", "ratio", &ratio), "ratio 1.00 (0.950 to 1.05)");
    }

    #[test]
    fn a_learned_correction_that_adds_nothing_is_no_bound_of_its_own() {
        assert_eq!(learned(0.8, Some(0.8)), "a learned correction on top finds nothing to add (80 %)");
        assert_eq!(learned(0.7, Some(0.8)), "a learned correction on top finds nothing to add (70 %)");
        assert!(learned(0.9, Some(0.8)).starts_with("with a learned correction on top 90 %"));
    }

    #[test]
    fn names_are_listed_as_one_speaks() {
        let told = [&["a"][..], &["a", "b"], &["a", "b", "c"]].map(listed);
        assert_eq!(told, ["a", "a and b", "a, b and c"]);
    }

    #[test]
    fn three_digits_are_kept() {
        assert_eq!([0.0, -0.0, 12345.6, 0.012345].map(rounded), ["0", "0", "12346", "0.0123"]);
        assert_eq!(rounded(-2.5), "-2.50");
    }
}
