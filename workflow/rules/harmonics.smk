# Component torques of each recording. Uncompensated recordings need --stand in the options.


rule harmonics:
    input:
        recordings=config["recordings"],
    output:
        log_of_part("harmonics"),
    threads: config["threads"]
    resources:
        mem_mb=config["memory_mb"],
        runtime=config["minutes"],
    retries: config["restarts"]
    params:
        torqcomp=config["torqcomp"],
        options=options_of("harmonics"),
    shell:
        "TORQCOMP={params.torqcomp:q} bash {PART:q} {RESULTS:q}/harmonics {wildcards.part}/{PARTS} "
        "harmonics {input.recordings:q} "
        "--jobs {threads} --quiet {params.options}"
