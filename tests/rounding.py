"""Tolerances of rounded results, from the number of operations and the precision.

Two processors, libraries or numbers of threads add the terms of a sum in different orders. A sum of
n terms has an error of at most gamma(n) sum |terms|, in any order (Higham, Accuracy and Stability
of Numerical Algorithms, 2002, section 4.2); two results differ by at most twice that.
"""

#: Unit round-off.
U32, U64 = 2.0**-24, 2.0**-53


def gamma(n: float, u: float = U32) -> float:
    """Return n u / (1 - n u), the largest relative error of n roundings."""
    return n * u / (1 - n * u)


def softmax_error(logit_error: float) -> float:
    """Return the largest error of a softmax of logits with an error of at most `logit_error`.

    dp_i = p_i (dz_i - sum_k p_k dz_k), so |dp_i| <= 2 p_i (1 - p_i) max |dz| <= max |dz| / 2.
    """
    return logit_error / 2
