# Functions that return inputs and parameters of rules. Most get the wildcards of a job.
def setting(name):
    """Return an input function for one key of dataset.yaml, as plain values."""
    return lambda wildcards: SPECS[wildcards.dataset].model_dump(
        mode="json", include={name}
    )[name]


def label_targets(wildcards):
    """Return the target of each label column of a data set, as plain values."""
    targets = SPECS[wildcards.dataset].label_targets
    return {name: target.model_dump(mode="json") for name, target in targets.items()}


@functools.cache
def tables_of(name):
    """Return the digests of the tables of a data set's sessions.

    Contents decide what is outdated, not times of files.
    """
    with errors_in_one_line():
        return run_tables(PATHS, name, PLANS[name].sessions, PLANS[name].virtual)


def session_tables(wildcards):
    """Return the digests of the tables of the sessions of the data set."""
    return tables_of(wildcards.dataset)


def feature_processes(wildcards):
    """Return the number of processes for the features: few if few recordings are new.

    Sessions that this run records do not count.
    """
    name = wildcards.dataset
    return process_count(count_changed(PATHS, name, PLANS[name].sessions))


def features_of(*names):
    """Return FEATURES and a digest of everything that determines the features of data sets.

    If the digest differs, a job that reads the features is outdated. The digest does not need the
    features, because Snakemake evaluates parameters before a run. The hashes of the features are
    also an input of these jobs: features of an older version have no hashes, and are computed
    again.
    """
    keys = []
    for name in names:
        spec = SPECS[name]
        recipes = [
            recipe_hash(spec.recipe, session, spec.excitation)
            for session in PLANS[name].virtual
        ]
        keys.append(features_key([*tables_of(name), *recipes], spec))
    return " ".join([FEATURES, *keys])


def own_features(wildcards):
    """Return `features_of` the data set of a job."""
    return features_of(wildcards.dataset)


def embedding_files(jobs):
    """Return latents and training cost of the embeddings that jobs of experiments use."""
    keys = dict.fromkeys(
        (item.dataset, item.task)
        for item in jobs.values()
        if item.experiment.of_embedding
    )
    latents = [PATHS.latents(*key) for key in keys]
    costs = [PATHS.training_cost(*key) for key in keys]
    return latents + costs


def requested(wildcards):
    """Return the request of a job of an experiment, with its parts and their settings."""
    return REQUESTS[
        wildcards.dataset, wildcards.task, wildcards.experiment, wildcards.models
    ]


def task_settings(wildcards):
    """Return the settings of the task, or of the embedding, of an experiment, as plain values."""
    settings = SPECS[wildcards.dataset].task_settings(wildcards.task)
    return settings.model_dump(mode="json", exclude_unset=True)


def other_tasks(wildcards):
    """Return the settings of the other tasks that an experiment needs, by name."""
    spec = SPECS[wildcards.dataset]
    return {
        name: spec.task_settings(name).model_dump(mode="json", exclude_unset=True)
        for name in requested(wildcards).other_tasks
    }


def training_settings(wildcards):
    """Return the settings of a task that its final models depend on, as plain values."""
    return SPECS[wildcards.dataset].training(wildcards.task).model_dump(mode="json")


def noise_sets(wildcards):
    """Return the data set whose recordings are the noise of a task's copies; none if none are."""
    noise_set = SPECS[wildcards.dataset].noise_sets.get(wildcards.task)
    return [noise_set] if noise_set else []


def training_code(wildcards):
    """Return the hash of the code of a final model, which depends on copies of recordings."""
    augment = SPECS[wildcards.dataset].tasks[wildcards.task].augment
    job_type = "train with copies" if augment else "train"
    return code_hash(job_type, models=(wildcards.model,))


def equal_model(wildcards):
    """Return the same final model of an earlier task with equal settings; none if there is none.

    The job copies this model, so it is trained once.
    """
    spec = SPECS[wildcards.dataset]
    task = spec.equal_training(wildcards.task, wildcards.model)
    return [PATHS.model(wildcards.dataset, task, wildcards.model)] if task else []


def solved_before(wildcards):
    """Return the same session of the data set `grasps_of` of the recipe.

    The job waits for this session, so the scenes of both data sets are solved once.
    """
    name = wildcards.dataset
    session = wildcards.session
    origin = SPECS[name].recipe.grasps_of
    if origin in (None, name) or origin not in PLANS:
        return []
    if session not in PLANS[origin].virtual:
        return []
    return [PATHS.acquired(origin, session)]


def recipe_of_session(wildcards):
    """Return RECIPE and the hash of the recipe's settings for a session."""
    spec = SPECS[wildcards.dataset]
    return f"{RECIPE} {recipe_hash(spec.recipe, wildcards.session, spec.excitation)}"


def embedding_settings(wildcards):
    """Return the settings of an embedding that determine its latents."""
    embedding = SPECS[wildcards.dataset].embeddings[wildcards.embedding]
    return embedding.model_dump(mode="json", exclude={"optional"})


def experiment_code(wildcards):
    """Return the hash of the code of an experiment."""
    request = requested(wildcards)
    return code_hash(
        request.job_type,
        *measuring_half(request.experiment.name),
        models=request.models,
    )


def report_code(wildcards):
    """Return the hash of the code that draws the report."""
    return package_hash(*own_experiment_files())


def rendered_from(wildcards):
    """Return RECIPE and the digest of the recipe whose scenes an experiment renders.

    Returns "" if it renders none.
    """
    recipe = SPECS[wildcards.dataset].recipe
    if not requested(wildcards).experiment.renders or recipe is None:
        return ""
    return f"{RECIPE} {settings_digest(recipe)}"


def encoder_files(wildcards):
    """Return latents and training cost, if an experiment is on an embedding."""
    if not requested(wildcards).experiment.of_embedding:
        return []
    return [
        PATHS.latents(wildcards.dataset, wildcards.task),
        PATHS.training_cost(wildcards.dataset, wildcards.task),
    ]
