def of_sessions(path):
    """All sessions of a data set, for one kind of file."""
    return lambda wildcards: [
        path(wildcards.dataset, session)
        for session in PLANS[wildcards.dataset].sessions
    ]


def of_runs(path):
    """All evaluated models, for one kind of file."""
    return [path(*run) for run in RUNS]


def declared(wildcards):
    """The task of a job, as it stands in dataset.yaml."""
    return PLANS[wildcards.dataset].spec.tasks[wildcards.task]


def declared_embedding(wildcards):
    """The embedding of a job, as it stands in dataset.yaml."""
    return PLANS[wildcards.dataset].spec.embeddings[wildcards.embedding]


def embedding_settings(wildcards):
    """The same as plain values, defaults included."""
    return declared_embedding(wildcards).model_dump(mode="json")
