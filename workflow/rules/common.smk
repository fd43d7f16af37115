# Shared by the rules of the verbs.

RESULTS = config["results"].rstrip("/")
PARTS = config["parts"]
PART = f"{workflow.basedir}/scripts/part"


wildcard_constraints:
    part=r"\d+",


def log_of_part(verb):
    """The file that exists once a part is done."""
    return f"{RESULTS}/{verb}.parts/{{part}}-of-{PARTS}.jsonl"


def options_of(verb):
    """The options of a verb; none if it is not run."""
    options = config["verbs"].get(verb, {"options": ""})["options"]
    # A function, so that braces in --name are not interpreted as wildcards.
    return lambda wildcards: options
