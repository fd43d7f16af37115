# Contents and faults of each recording.


rule inspect:
    input:
        recordings=config["recordings"],
    output:
        log_of_part("inspect"),
    threads: config["threads"]
    resources:
        mem_mb=config["memory_mb"],
        runtime=config["minutes"],
    retries: config["restarts"]
    params:
        torqcomp=config["torqcomp"],
        options=options_of("inspect"),
    shell:
        "TORQCOMP={params.torqcomp:q} bash {PART:q} {RESULTS:q}/inspect {wildcards.part}/{PARTS} "
        "inspect {input.recordings:q} "
        "--jobs {threads} --quiet {params.options}"
