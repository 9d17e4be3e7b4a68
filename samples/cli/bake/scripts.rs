//! Text for engines that run a command on several machines: a task for each shard, and one that joins after all of them.

use std::path::Path;

use lucerna::Result;
use serde_json::json;

use super::plan::{Format, wrong};
use crate::shell::{self, quoted};

/// A command, and how it is spread.
pub(super) struct Command<'a> {
    words: &'a [String],
    name: String,
    /// The file that it writes.
    output: String,
    shards: u64,
}

impl<'a> Command<'a> {
    /// # Errors
    /// `Usage` if the command has `--shard` already, writes no file, or cannot be text.
    pub(super) fn new(words: &'a [String], name: Option<&str>, shards: u64) -> Result<Self> {
        if let Some(word) = words.iter().find(|word| *word == "--shard" || word.starts_with("--shard=")) {
            return Err(wrong(format!("has `{word}` already")).help("Leave it out: the plan adds it to each task"));
        }
        if let Some(word) = words.iter().chain(name.map(str::to_owned).as_ref()).find(|w| w.contains(char::is_control))
        {
            let what = format!("`{}` has a line break or another control character", word.escape_debug());
            return Err(wrong(what).help("Rename the file"));
        }
        let Some(output) = output(words) else {
            return Err(wrong("names no file to write").help("Give it -o FILE"));
        };
        // An experiment writes a folder; its report is written last.
        let written = match words.iter().take(2).any(|word| word == "reproduce") {
            true => Path::new(output).join("report.html").to_string_lossy().into_owned(),
            false => output.to_owned(),
        };
        let own = Path::new(output).file_name().map(|name| name.to_string_lossy().into_owned());
        let name: String = name.map_or_else(|| own.unwrap_or_default(), str::to_owned);
        let good = |c: char| if c.is_ascii_alphanumeric() || "._-".contains(c) { c } else { '_' };
        let name: String = name.chars().map(good).take(60).collect();
        Ok(Self { words, name, output: written, shards })
    }

    fn shell(&self) -> String {
        shell::line(self.words)
    }

    fn begin(&self, comment: &str) -> String {
        format!(
            "# Written by `lucerna bake plan`: {} in {} shards. A shard that was stopped goes on where it was when it is run again.\n{comment}",
            self.name, self.shards
        )
    }

    /// # Errors
    /// `Usage` if the engine would read a word as something else.
    pub(super) fn text(&self, format: Format) -> Result<String> {
        match format {
            Format::Slurm => Ok(self.slurm()),
            Format::OpenJd => self.openjd(),
            Format::Parallel => self.parallel(),
            Format::Snakemake => Ok(self.snakemake()),
        }
    }

    fn slurm(&self) -> String {
        let Self { name, shards, .. } = self;
        let begin = self.begin(
            "# Submit it with `sh FILE`, where the files are seen by all machines. Partition, account and time come from sbatch's own variables\n\
             # (SBATCH_PARTITION, SBATCH_ACCOUNT, SBATCH_TIMELIMIT). With --time-limit shards end by themselves before Slurm ends them.\n",
        );
        // No script of its own: what is submitted is what stands here.
        let task = quoted(&format!("exec {} --shard auto/{shards}", self.shell()));
        let join = quoted(&format!("exec {}", self.shell()));
        format!(
            "#!/bin/sh\n{begin}set -eu\n\
             array=$(sbatch --parsable --job-name={name} --array=0-{last} --wrap {task})\n\
             sbatch --job-name={name}-join --dependency=afterok:\"${{array%%;*}}\" --wrap {join}\n",
            last = shards - 1
        )
    }

    fn parallel(&self) -> Result<String> {
        if let Some(word) = self.words.iter().find(|word| word.contains('{') || word.contains('}')) {
            return Err(wrong(format!("`{word}` has braces, which GNU parallel reads as places to fill"))
                .help("Rename the file"));
        }
        let Self { name, shards, .. } = self;
        let begin = self.begin(
            "# JOBS shards run at once, each on the device that it finds best; PARALLEL='--sshlogin HOST,...' in the environment takes more machines.\n",
        );
        let task = quoted(&format!("{} --shard {{}}/{shards}", self.shell()));
        let log = quoted(&format!("{name}.joblog"));
        let join = self.shell();
        Ok(format!(
            "#!/bin/sh\n{begin}set -eu\n\
             seq {shards} | parallel --jobs \"${{JOBS:-1}}\" --joblog {log} --resume-failed {task}\n\
             exec {join}\n"
        ))
    }

    fn snakemake(&self) -> String {
        let Self { name, shards, output, .. } = self;
        let begin = self.begin(
            "# Run it with `snakemake -s FILE --cores all --resources device=1`: one shard at once for each device.\n",
        );
        let text = |text: &str| json!(text).to_string();
        // Braces are places to fill.
        let command = self.shell().replace('{', "{{").replace('}', "}}");
        let mark = |shard: &str| text(&format!("{name}.shards/{shard}"));
        let shard_command = text(&format!("{command} --shard {{wildcards.shard}}/{shards}"));
        format!(
            "{begin}\nrule join:\n    input: expand({all}, shard=range(1, {end}))\n    output: {output}\n    resources: device=1\n    shell: {join}\n\n\
             rule shard:\n    output: touch({one})\n    resources: device=1\n    shell: {shard_command}\n",
            all = mark("{shard}"),
            one = mark("{shard}"),
            end = shards + 1,
            output = text(&output.replace('{', "{{").replace('}', "}}")),
            join = text(&command),
        )
    }

    fn openjd(&self) -> Result<String> {
        if let Some(word) = self.words.iter().find(|word| word.contains("{{")) {
            return Err(wrong(format!("`{word}` has two braces, which Open Job Description reads as a place to fill"))
                .help("Rename the file"));
        }
        let action = |shard: Option<String>| {
            // Names of files count from the folder of the job, wherever the engine starts the command.
            let script = "cd \"$1\" && shift && exec \"$@\"";
            let mut words = vec!["-c".to_owned(), script.to_owned(), "sh".to_owned(), "{{Param.Folder}}".to_owned()];
            words.extend_from_slice(self.words);
            words.extend(["--progress".to_owned(), "openjd".to_owned()]);
            words.extend(shard.into_iter().flat_map(|shard| ["--shard".to_owned(), shard]));
            json!({
                "actions": {
                    "onRun": {
                        "command": "sh",
                        "args": words,
                        "cancelation": { "mode": "NOTIFY_THEN_TERMINATE", "notifyPeriodInSeconds": 20 },
                    }
                }
            })
        };
        let shard = format!("{{{{Task.Param.Shard}}}}/{}", self.shards);
        let template = json!({
            "specificationVersion": "jobtemplate-2023-09",
            "name": self.name,
            "description": "Written by `lucerna bake plan`. A shard that was stopped goes on where it was when it is run again.",
            "parameterDefinitions": [{
                "name": "Folder",
                "type": "PATH",
                "objectType": "DIRECTORY",
                "dataFlow": "INOUT",
                "default": ".",
                "description": "Where the command is run",
            }],
            "steps": [
                {
                    "name": "Shards",
                    "parameterSpace": {
                        "taskParameterDefinitions": [
                            { "name": "Shard", "type": "INT", "range": format!("1-{}", self.shards) }
                        ]
                    },
                    "script": action(Some(shard)),
                },
                { "name": "Join", "dependencies": [{ "dependsOn": "Shards" }], "script": action(None) },
            ],
        });
        Ok(format!("{template:#}\n"))
    }
}

/// The value of -o or --output.
fn output(words: &[String]) -> Option<&str> {
    let mut found = None;
    for (at, word) in words.iter().enumerate() {
        match word.as_str() {
            "-o" | "--output" => found = words.get(at + 1).map(String::as_str),
            word => {
                let joined =
                    word.strip_prefix("--output=").or(word.strip_prefix("-o").filter(|_| !word.starts_with("--")));
                found = joined.map(|name| name.trim_start_matches('=')).or(found);
            }
        }
    }
    found.filter(|name| !name.is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(text: &[&str]) -> Vec<String> {
        text.iter().map(|word| (*word).to_owned()).collect()
    }

    const COMMAND: [&str; 7] =
        ["fiv", "precompute", "my scene's.glb", "--environment", "sky.exr", "-o", "out/scene.fiv"];

    fn text(format: Format, more: &[&str]) -> Result<String> {
        let words = words(&[&COMMAND[..], more].concat());
        Command::new(&words, None, 8)?.text(format)
    }

    #[test]
    fn the_file_that_is_written_is_found() {
        for (given, found) in [
            (&["x", "-o", "a.fiv"][..], Some("a.fiv")),
            (&["x", "-oa.fiv"], Some("a.fiv")),
            (&["x", "--output=a.fiv"], Some("a.fiv")),
            (&["x", "--output", "a.fiv", "-o", "b.fiv"], Some("b.fiv")),
            (&["x", "-o"], None),
            (&["x", "--overwrite"], None),
        ] {
            assert_eq!(output(&words(given)), found, "{given:?}");
        }
    }

    #[test]
    fn what_cannot_be_spread_is_refused_and_named() {
        let refused = |given: &[&str], part: &str| {
            let words = words(given);
            let error = Command::new(&words, None, 8).map(drop).unwrap_err();
            assert!(error.exit_code() == 2 && error.to_string().contains(part), "{error}");
        };
        refused(&["fiv", "precompute", "-o", "a.fiv", "--shard", "1/2"], "`--shard` already");
        refused(&["fiv", "precompute", "-o", "a.fiv", "--shard=1/2"], "`--shard=1/2` already");
        refused(&["fiv", "precompute", "a.glb"], "-o FILE");
        refused(&["fiv", "a\nb.glb", "-o", "a.fiv"], "line break");
        assert!(text(Format::Parallel, &["{}.glb"]).unwrap_err().to_string().contains("braces"));
        assert!(text(Format::OpenJd, &["{{x}}"]).unwrap_err().to_string().contains("two braces"));
        assert!(text(Format::Snakemake, &["{x}"]).unwrap().contains("'{{x}}'"));
    }

    /// The script runs with stand-ins for the engine and for the program; they write down what they were asked.
    #[test]
    fn scripts_ask_for_every_shard_and_then_for_the_rest() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let stand_in = |name: &str, text: &str| {
            std::fs::write(at(name), format!("#!/bin/sh\n{text}\n")).unwrap();
            let mode = std::os::unix::fs::PermissionsExt::from_mode(0o755);
            std::fs::set_permissions(at(name), mode).unwrap();
        };
        stand_in("fiv", "for word; do printf '<%s>' \"$word\" >>log; done; echo >>log");
        // As Slurm: runs each task of the array, one after the other.
        stand_in(
            "sbatch",
            "for word; do case $word in --array=0-*) last=${word#--array=0-};; --parsable) echo '7;cluster';; --dependency=*) echo \"$word\" >>log;; esac; done\n\
             if [ -n \"${last:-}\" ]; then for i in $(seq 0 \"$last\"); do eval \"(set -- ; $word)\"; done; else eval \"($word)\"; fi",
        );
        stand_in(
            "parallel",
            "for word; do :; done; while read -r i; do sh -c \"$(printf %s \"$word\" | sed \"s/{}/$i/\")\"; done",
        );
        let path = format!("{}:{}", folder.path().display(), std::env::var("PATH").unwrap());
        let base: String = COMMAND[1..].iter().map(|word| format!("<{word}>")).collect();
        for (format, shards) in [(Format::Slurm, false), (Format::Parallel, true)] {
            let _ = std::fs::remove_file(at("log"));
            std::fs::write(at("script"), text(format, &[]).unwrap()).unwrap();
            let mut run = std::process::Command::new("sh");
            let status = run
                .arg("script")
                .current_dir(folder.path())
                .env("PATH", &path)
                .stdout(std::process::Stdio::null())
                .status();
            assert!(status.unwrap().success());
            let log = std::fs::read_to_string(at("log")).unwrap();
            let lines: Vec<&str> = log.lines().filter(|line| !line.starts_with("--")).collect();
            assert_eq!(lines.len(), 9, "{log}");
            for (number, line) in lines[..8].iter().enumerate() {
                let shard = if shards { format!("{}/8", number + 1) } else { "auto/8".into() };
                assert_eq!(*line, format!("{base}<--shard><{shard}>"));
            }
            assert_eq!(lines[8], base);
            assert_eq!(log.contains("--dependency=afterok:7"), !shards);
        }
    }

    #[test]
    fn templates_have_a_task_for_each_shard_and_a_step_after_them() {
        let template: serde_json::Value = serde_json::from_str(&text(Format::OpenJd, &[]).unwrap()).unwrap();
        let [shards, join] = [0, 1].map(|step| &template["steps"][step]);
        assert_eq!(shards["parameterSpace"]["taskParameterDefinitions"][0]["range"], "1-8");
        let args = shards["script"]["actions"]["onRun"]["args"].as_array().unwrap();
        assert_eq!(args[args.len() - 1], "{{Task.Param.Shard}}/8");
        assert!(args.contains(&json!("my scene's.glb")));
        assert_eq!(join["dependencies"][0]["dependsOn"], "Shards");
        let snake = text(Format::Snakemake, &[]).unwrap();
        assert!(snake.contains("range(1, 9)") && snake.contains("output: \"out/scene.fiv\""), "{snake}");
        assert!(snake.contains("--shard {wildcards.shard}/8"));
        let reproduce = words(&["lucerna", "reproduce", "smoke", "-o", "all/smoke"]);
        let snake = Command::new(&reproduce, None, 8).unwrap().text(Format::Snakemake).unwrap();
        assert!(snake.contains("output: \"all/smoke/report.html\"") && snake.contains("\"smoke.shards/"), "{snake}");
    }
}
