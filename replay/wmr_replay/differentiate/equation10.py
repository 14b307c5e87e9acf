"""Equation (10) of Yu, Barbot, Floquet (2009), corrected, in exact rationals.

Printed, it lacks 1/(ν+κ−i−j−1)! inside the sum and T⁻ⁿ in front, prints k for κ in j₀, and estimates at the
window's start, which needs later samples. Causal and corrected, with ν = N + 1 + μ and τ = age/T:

    x̂⁽ⁿ⁾(t) = (−1)ⁿ T⁻ⁿ A Σ_{i=0}^{N−n} B Σ_{j=max(0,κ−i)}^{n+κ} C/(ν+κ−i−j−1)! ∫₀¹ (1−τ)^{ν+κ−i−j−1}
    (−τ)^{i+j} y(t−Tτ) dτ A = (−1)^{n+κ} (ν+n+κ)!/((n+κ)! (N−n)!),  B = C(N−n, i) (N+1)!/(n+i+1)!,  C = C(n+κ,
    j) (n+i)!/(i+j−κ)!
"""

from fractions import Fraction
from math import comb, factorial


def kernel_polynomial(n: int, N: int, kappa: int, mu: int) -> list[Fraction]:
    """Coefficients c_p of the kernel on T = 1: x̂⁽ⁿ⁾ = ∫₀¹ Σ_p c_p τᵖ y(t − τ) dτ (delay 0: θ = 1).

    Raises ValueError unless 0 ≤ n ≤ N and κ, μ ≥ 0.
    """
    if not 0 <= n <= N or kappa < 0 or mu < 0:
        raise ValueError(f"need 0 <= n <= N and kappa, mu >= 0, not {(n, N, kappa, mu)}")
    nu = N + 1 + mu
    front = Fraction(
        (-1) ** n * (-1) ** (n + kappa) * factorial(nu + n + kappa), factorial(n + kappa) * factorial(N - n)
    )
    kernel = [Fraction(0)] * (nu + kappa)
    for i in range(N - n + 1):
        b = comb(N - n, i) * Fraction(factorial(N + 1), factorial(n + i + 1))
        for j in range(max(0, kappa - i), n + kappa + 1):
            c = comb(n + kappa, j) * Fraction(factorial(n + i), factorial(i + j - kappa))
            rest = nu + kappa - i - j - 1
            term = front * b * c / factorial(rest)
            for k in range(rest + 1):
                kernel[k + i + j] += term * comb(rest, k) * (-1) ** k * (-1) ** (i + j)
    return kernel
