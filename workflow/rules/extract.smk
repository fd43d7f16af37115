# One channel of each recording as plain rows.


rule extract:
    input:
        recordings=config["recordings"],
    output:
        log_of_part("extract"),
    threads: config["threads"]
    resources:
        mem_mb=config["memory_mb"],
        runtime=config["minutes"],
    retries: config["restarts"]
    params:
        torqcomp=config["torqcomp"],
        options=options_of("extract"),
    shell:
        "TORQCOMP={params.torqcomp:q} bash {PART:q} {RESULTS:q}/extract {wildcards.part}/{PARTS} "
        "extract {input.recordings:q} "
        "--jobs {threads} --quiet {params.options}"
