"""
Rotations. Quaternions are Hamilton, wxyz; perturbations are on the right, R_true = R * Exp(theta), theta in the body's axes [rad]. Every function takes one row or an array of N rows and gives float64 accordingly.
"""
from __future__ import annotations
import numpy
import numpy.typing
import typing
__all__: list[str] = ['angle_between', 'boxminus', 'boxplus', 'exp', 'heading', 'left_jacobian', 'log', 'right_jacobian']
def angle_between(q1_wxyz: numpy.typing.ArrayLike, q0_wxyz: numpy.typing.ArrayLike) -> float | numpy.typing.NDArray[numpy.float64]:
    """
    Angle of rotation [rad] in [0, pi]: a float, or an array (N,).
    """
def boxminus(q1_wxyz: numpy.typing.ArrayLike, q0_wxyz: numpy.typing.ArrayLike) -> numpy.typing.NDArray[numpy.float64]:
    """
    theta [rad] with boxplus(q0, theta) = q1.
    """
def boxplus(q_wxyz: numpy.typing.ArrayLike, theta: numpy.typing.ArrayLike) -> numpy.typing.NDArray[numpy.float64]:
    """
    q * Exp(theta).
    """
def exp(theta: numpy.typing.ArrayLike) -> numpy.typing.NDArray[numpy.float64]:
    """
    Rotation vectors (3,) or (N, 3) [rad] to unit quaternions wxyz (4,) or (N, 4).
    """
def heading(q_wxyz: numpy.typing.ArrayLike) -> float | numpy.typing.NDArray[numpy.float64]:
    """
    Rotation about z [rad] that is closest to q: a float, or an array (N,).
    """
def left_jacobian(theta: numpy.typing.ArrayLike) -> numpy.typing.NDArray[numpy.float64]:
    """
    (3, 3) matrix J with Exp(theta + d) = Exp(J d) * Exp(theta) to first order.
    """
def log(q_wxyz: numpy.typing.ArrayLike) -> numpy.typing.NDArray[numpy.float64]:
    """
    Unit quaternions wxyz to rotation vectors [rad] with norm in [0, pi].
    """
def right_jacobian(theta: numpy.typing.ArrayLike) -> numpy.typing.NDArray[numpy.float64]:
    """
    (3, 3) matrix J with Exp(theta + d) = Exp(theta) * Exp(J d) to first order.
    """
