//! `surefoot gap effects`: the catalogue, in words and as what each effect does to a drive.

use bicycle::effect::CATALOGUE;
use sim_to_real::signature;

use crate::arguments::GapEffectsArguments;
use crate::output;

pub(super) fn run(arguments: &GapEffectsArguments) -> anyhow::Result<()> {
    let Some(out) = &arguments.out else {
        print!("{}", report::effects::text());
        return Ok(());
    };
    output::prepare_folder("--out", out)?;
    formats::write_bytes_atomic(&out.join("effects.md"), report::effects::page().as_bytes())?;
    let signatures = CATALOGUE.iter().map(signature).collect::<Result<Vec<_>, _>>()?;
    formats::write_bytes_atomic(&out.join("effects.png"), &report::effects::picture(&signatures)?)?;
    println!("effects.md and effects.png in {}", out.display());
    Ok(())
}
