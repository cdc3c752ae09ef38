"""An attitude controller in Python, packed as an FMU by PythonFMU with
`pythonfmu build -f pd_controller.py`.

The moment is proportional to the errors of the angles and damped by their rates. It is computed in
the step for which the inputs are set and read after it: where this FMU is stepped before the
vehicle, as in the orchestrator, the loop has no delay.
"""

from math import cos, sin

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real


class PdController(Fmi2Slave):
    author = "Re-entry Attitude Control"

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.inputs = {
            **{f"attitude.{axis}": 0.0 for axis in ("alpha", "beta", "sigma")},
            **{f"attitudeRate.{axis}": 0.0 for axis in ("alpha", "beta", "sigma")},
        }
        self.parameters = {
            **{f"reference.{axis}": 0.0 for axis in ("alpha", "beta", "sigma")},  # rad
            "inertia.Ixx": 588791.0,  # kg m2
            "inertia.Iyy": 1303212.0,
            "inertia.Izz": 1534163.0,
            "frequency": 0.5,  # rad/s, of the closed loop without the couplings
            "damping": 0.8,
        }
        self.outputs = {f"moment.{axis}": 0.0 for axis in "xyz"}  # N m
        self._register(self.inputs, Fmi2Causality.input, Fmi2Variability.continuous)
        self._register(self.parameters, Fmi2Causality.parameter, Fmi2Variability.tunable)
        self._register(self.outputs, Fmi2Causality.output, Fmi2Variability.continuous)

    def _register(self, values, causality, variability):
        for name in values:
            getter, setter = (lambda n=name: values[n]), (lambda value, n=name: values.__setitem__(n, value))
            self.register_variable(Real(name, causality=causality, variability=variability, getter=getter, setter=setter))

    def do_step(self, current_time, step_size):
        frequency, damping = self.parameters["frequency"], self.parameters["damping"]
        a = [
            -(frequency**2) * (self.inputs[f"attitude.{axis}"] - self.parameters[f"reference.{axis}"])
            - 2.0 * damping * frequency * self.inputs[f"attitudeRate.{axis}"]
            for axis in ("alpha", "beta", "sigma")
        ]
        sa, ca = sin(self.inputs["attitude.alpha"]), cos(self.inputs["attitude.alpha"])
        sb, cb = sin(self.inputs["attitude.beta"]), cos(self.inputs["attitude.beta"])
        # Chai 2022, proof of Lemma 1: m = I R^-1 a, here without products of inertia and of rates.
        inertia = [self.parameters[f"inertia.{axis}"] for axis in ("Ixx", "Iyy", "Izz")]
        self.outputs["moment.x"] = inertia[0] * (-sb * ca * cb * a[0] + sa * a[1] - cb * ca * a[2])
        self.outputs["moment.y"] = inertia[1] * (cb * cb * a[0] - sb * a[2])
        self.outputs["moment.z"] = inertia[2] * (-sa * cb * sb * a[0] - ca * a[1] - cb * sa * a[2])
        return True
