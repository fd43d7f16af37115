# The applied torque of each recording.


rule compensate:
    input:
        recordings=config["recordings"],
        stand=config["stand"],
    output:
        log_of_part("compensate"),
    threads: config["threads"]
    resources:
        mem_mb=config["memory_mb"],
        runtime=config["minutes"],
    retries: config["restarts"]
    params:
        torqcomp=config["torqcomp"],
        options=options_of("compensate"),
    shell:
        "TORQCOMP={params.torqcomp:q} bash {PART:q} {RESULTS:q}/compensate {wildcards.part}/{PARTS} "
        "compensate {input.recordings:q} "
        "--stand {input.stand:q} "
        "--jobs {threads} --quiet {params.options}"
