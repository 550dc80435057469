# Input functions and parameters that several rules use.
def setting(name):
    """One key of the configuration of a job's data set, as plain values."""
    return lambda wildcards: SPECS[wildcards.dataset].model_dump(
        mode="json", include={name}
    )[name]


@functools.cache
def tables_of(name):
    """Digests of the tables of a data set's sessions. Contents decide, not times of files."""
    with errors_in_one_line():
        return run_tables(PATHS, name, PLANS[name].sessions, PLANS[name].virtual)


def session_tables(wildcards):
    """Digests of the tables of the sessions of a job's data set."""
    return tables_of(wildcards.dataset)


def feature_processes(wildcards):
    """Processes for the features of a data set: few if few recordings are new.

    Sessions that this run records do not count.
    """
    name = wildcards.dataset
    return process_count(count_changed(PATHS, name, PLANS[name].sessions))


def features_of(*names):
    """Digest of all that features follow from: a job that reads them is outdated if it differs.

    It is known before the features are computed, because Snakemake may fix a parameter before a
    run. The hashes of the features are also an input of the job: features of an older version,
    which have none, are computed again.
    """
    keys = []
    for name in names:
        spec = SPECS[name]
        recipes = [
            recipe_hash(spec.recipe, session, spec.excitation)
            for session in PLANS[name].virtual
        ]
        keys.append(features_key([*tables_of(name), *recipes], spec))
    return " ".join(keys)


def own_features(wildcards):
    """Digest of the features of a job's data set."""
    return features_of(wildcards.dataset)


def embedding_files(jobs):
    """Latents and training cost of the embeddings that jobs of experiments use."""
    embeddings = {
        (item.dataset, item.task): None
        for item in jobs.values()
        if item.experiment.of_embedding
    }
    files = [PATHS.latents(*key) for key in embeddings]
    return files + [PATHS.training_cost(*key) for key in embeddings]


def requested(wildcards):
    """The experiment of a job: its parts and their settings."""
    return REQUESTS[
        wildcards.dataset, wildcards.task, wildcards.experiment, wildcards.models
    ]


def task_settings(wildcards):
    """Settings of the task, or of the embedding, of an experiment, as plain values."""
    settings = SPECS[wildcards.dataset].task_settings(wildcards.task)
    return settings.model_dump(mode="json", exclude_unset=True)


def other_tasks(wildcards):
    """Settings of the other tasks that an experiment needs, by name, as plain values."""
    spec = SPECS[wildcards.dataset]
    return {
        name: spec.task_settings(name).model_dump(mode="json", exclude_unset=True)
        for name in requested(wildcards).other_tasks
    }


def trainings(wildcards):
    """Models of each task of a data set, and the settings of their training, as plain values."""
    tasks = SPECS[wildcards.dataset].trainings()
    return {name: task.model_dump(mode="json") for name, task in tasks.items()}


def solved_before(wildcards):
    """The same session of the data set whose grasps the recipe draws: its scenes are solved once."""
    name, session = wildcards.dataset, wildcards.session
    origin = SPECS[name].recipe.grasps_of
    if origin in (None, name) or origin not in PLANS:
        return []
    return [PATHS.acquired(origin, session)] if session in PLANS[origin].virtual else []


def recipe_of_session(wildcards):
    """Hash of the recipe's settings for a session."""
    spec = SPECS[wildcards.dataset]
    return recipe_hash(spec.recipe, wildcards.session, spec.excitation)


def embedding_settings(wildcards):
    """Settings of an embedding that its latents follow from."""
    embedding = SPECS[wildcards.dataset].embeddings[wildcards.embedding]
    return embedding.model_dump(mode="json", exclude={"optional"})


def experiment_code(wildcards):
    """Hash of the code of an experiment."""
    experiment = requested(wildcards).experiment
    return code_hash(experiment.job_type, *measuring_half(experiment.name))


def report_code(wildcards):
    """Hash of the code that draws the report."""
    return package_hash(*own_experiment_files())


def rendered_from(wildcards):
    """Digest of the recipe whose scenes an experiment renders again, "" if it renders none."""
    recipe = SPECS[wildcards.dataset].recipe
    if not requested(wildcards).experiment.renders or recipe is None:
        return ""
    return settings_digest(recipe)


def encoder_files(wildcards):
    """Latents and training cost, for the experiments on them."""
    key = wildcards.dataset, wildcards.task
    if not requested(wildcards).experiment.of_embedding:
        return []
    return [PATHS.latents(*key), PATHS.training_cost(*key)]
