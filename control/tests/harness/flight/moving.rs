//! The vehicle that moves under a disturbance.

use super::Flight;
use control::crmpc::Settings;
use nalgebra::Vector3;
use vehicle::dynamics::RigidBody;
use vehicle::integrator::rk4;
use vehicle::kinematics::Kinematics;
use vehicle::plant::{self, Load, State};
use vehicle::transport::Transport;

/// The plant with a disturbance that is set from step to step.
pub(super) struct Vehicle {
    pub(super) body: RigidBody,
    state: State,
    commanded: Vector3<f64>,
    transport: Option<Transport>,
}

impl Vehicle {
    pub(super) fn new(flight: &Flight) -> Self {
        let Settings { body, delay, .. } = &flight.settings;
        Self {
            body: RigidBody::new(flight.inertia(&body.inertia)).unwrap(),
            state: plant::state(&flight.angles, &flight.rates),
            commanded: Vector3::zeros(),
            transport: Transport::new(delay - flight.age + flight.late).unwrap(),
        }
    }

    pub(super) fn angles(&self) -> Vector3<f64> {
        plant::angles(&self.state)
    }

    pub(super) fn rates(&self) -> Vector3<f64> {
        plant::rates(&self.state)
    }

    pub(super) fn command(&mut self, time: f64, moment: Vector3<f64>) {
        self.commanded = moment;
        if let Some(transport) = &mut self.transport {
            transport.command(time, moment).unwrap();
        }
    }

    /// Returns the acting moment, N m.
    pub(super) fn moment(&self, time: f64) -> Vector3<f64> {
        self.transport.as_ref().map_or(self.commanded, |transport| transport.moment(time))
    }

    pub(super) fn advance(&mut self, from: f64, to: f64, delta: &Vector3<f64>) {
        let mut time = from;
        while time < to {
            let arrival =
                self.transport.as_ref().and_then(|transport| transport.next_arrival(time));
            let end =
                arrival.filter(|&arrival| arrival > time && arrival < to - 1e-9).unwrap_or(to);
            let load = Load { moment: self.moment(time), delta: *delta, ..Load::default() };
            let mut f = |_: f64, state: &State| {
                plant::derivative(&self.body, Kinematics::Printed, state, &load)
            };
            self.state = rk4(&mut f, time, &self.state, end - time);
            time = end;
        }
    }
}
