# What the rules of the verbs share.

RESULTS = config["results"].rstrip("/")
PARTS = config["parts"]
PART = f"{workflow.basedir}/scripts/part"


wildcard_constraints:
    part=r"\d+",


def log_of_part(verb):
    """The file that is there once a part is done."""
    return f"{RESULTS}/{verb}.parts/{{part}}-of-{PARTS}.jsonl"


def options_of(verb):
    """The options of a verb; none if it is not run."""
    options = config["verbs"].get(verb, {"options": ""})["options"]
    # As a function, so that braces of --name are not taken for wildcards.
    return lambda wildcards: options
