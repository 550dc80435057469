"""A linear model of the principal components that explain 95 % of the variance."""

from sklearn.decomposition import PCA
from sklearn.linear_model import LogisticRegression, Ridge
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler


def pca_linear(kind: str, seed: int):
    """Return an unfitted estimator of features (n, n_features); `kind` is that of the target."""
    final = Ridge() if kind == "regression" else LogisticRegression(max_iter=1000)
    components = PCA(n_components=0.95, svd_solver="full", random_state=seed)
    return make_pipeline(StandardScaler(), components, final)
