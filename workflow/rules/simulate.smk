# The stand's response to the applied quantity of each recording.


rule simulate:
    input:
        recordings=config["recordings"],
        stand=config["stand"],
    output:
        log_of_part("simulate"),
    threads: config["threads"]
    resources:
        mem_mb=config["memory_mb"],
        runtime=config["minutes"],
    retries: config["restarts"]
    params:
        torqcomp=config["torqcomp"],
        options=options_of("simulate"),
    shell:
        "TORQCOMP={params.torqcomp:q} bash {PART:q} {RESULTS:q}/simulate {wildcards.part}/{PARTS} "
        "simulate {input.recordings:q} "
        "--stand {input.stand:q} "
        "--jobs {threads} --quiet {params.options}"
