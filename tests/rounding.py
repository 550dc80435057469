"""Tolerances of rounded results, from the number of operations and the precision.

Two processors, libraries or numbers of threads add the terms of a sum in different orders. A sum of
n terms has an error of at most gamma(n) sum |terms|, in any order (Higham, Accuracy and Stability
of Numerical Algorithms, 2002, section 4.2); two results differ by at most twice that.
"""

#: Unit round-off.
U32 = 2.0**-24


def gamma(n: float, u: float = U32) -> float:
    """Return n u / (1 - n u), the largest relative error of n roundings."""
    return n * u / (1 - n * u)
