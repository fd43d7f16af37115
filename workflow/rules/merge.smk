# The table of all recordings of a verb, and a check that not too many of them failed.

import csv


localrules:
    merge,
    check,


rule merge:
    input:
        expand(RESULTS + "/{{verb}}.parts/{part}-of-{parts}.jsonl", part=range(1, PARTS + 1), parts=PARTS),
    output:
        RESULTS + "/{verb}.csv",
    params:
        torqcomp=config["torqcomp"],
        manifests=lambda wildcards: f"{RESULTS}/{wildcards.verb}/torqcomp-manifest.*-of-{PARTS}.jsonl",
    # The exit code is 1 also if recordings failed; the table exists then.
    shell:
        "{params.torqcomp:q} merge {params.manifests:q} -o {output:q} || test -e {output:q}"


# A separate rule, since Snakemake removes the outputs of a rule that fails.
rule check:
    input:
        RESULTS + "/{verb}.csv",
    output:
        touch(RESULTS + "/{verb}.checked"),
    params:
        allowed=config["allowed_failures"],
    run:
        with open(input[0], newline="", encoding="utf-8") as table:
            failed = [row for row in csv.DictReader(table) if row["exit"] not in ("0", "3")]
        for row in failed:
            print(f"failed: {row['error']}")
        if len(failed) > params.allowed:
            raise WorkflowError(
                f"{wildcards.verb}: {len(failed)} recordings failed, {params.allowed} may (allowed_failures); "
                f"all are in {input[0]}"
            )
