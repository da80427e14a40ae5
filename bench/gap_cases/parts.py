"""The actuators that every plant has, and what an injection changes in them (keys part_*)."""

from dataclasses import dataclass, replace

from command_path import Backlash, Delay
from forces import Motion


@dataclass(frozen=True)
class Parts:
    """Servo, motor, wheels, tyres and load of one vehicle."""

    servo_time_constant_s: float
    servo_rate_radps: float
    servo_delay_s: float
    speed_gain_per_s: float
    traction_mps2: float
    braking_mps2: float
    motor_time_constant_s: float
    friction: float
    """Peak tyre friction."""
    motor_delay_s: float = 0.0
    servo_trim_rad: float = 0.0
    servo_ratio: float = 1.0
    servo_play_rad: float = 0.0
    steering_compliance: float = 0.0
    """Steering lost to lateral acceleration [rad s2/m]."""
    wheel_radius_ratio: float = 1.0
    """True wheel radius over the one the speed controller believes."""
    payload_ratio: float = 1.0
    brake_drag_mps2: float = 0.0
    """Deceleration by dragging brakes, made by a torque at the wheels."""

    def with_faults(self, injection: dict) -> "Parts":
        """These parts with the injection's changes; lags and delays add to what is there."""
        get = injection.get
        limit = get("part_torque_limit", self.traction_mps2)
        return replace(
            self,
            servo_time_constant_s=self.servo_time_constant_s + get("part_servo_time_constant", 0.0),
            servo_rate_radps=min(self.servo_rate_radps, get("part_servo_rate", self.servo_rate_radps)),
            servo_delay_s=self.servo_delay_s + get("part_servo_queue", 0.0),
            servo_trim_rad=get("part_servo_trim", 0.0),
            servo_ratio=get("part_steering_ratio", 1.0),
            servo_play_rad=get("part_linkage_play", 0.0),
            steering_compliance=get("part_steering_compliance", 0.0),
            traction_mps2=min(self.traction_mps2, limit),
            braking_mps2=min(self.braking_mps2, limit),
            motor_time_constant_s=self.motor_time_constant_s + get("part_motor_time_constant", 0.0),
            motor_delay_s=get("part_motor_queue", 0.0),
            wheel_radius_ratio=get("part_wheel_radius", 1.0),
            payload_ratio=get("mass", 1.0),
            friction=get("mu", self.friction),
            brake_drag_mps2=get("part_brake_drag", 0.0),
        )


class ActuatorInput:
    """Queue, linkage play, ratio, trim and compliance ahead of the servo, and the queue ahead of the motor."""

    def __init__(self, parts: Parts):
        self.parts = parts
        self.steer_queue, self.speed_queue = Delay(parts.servo_delay_s), Delay(parts.motor_delay_s)
        self.play = Backlash(parts.servo_play_rad)
        self.lateral_acceleration_mps2 = 0.0

    def targets(self, speed_mps: float, steer_rad: float, motion: Motion) -> tuple[float, float]:
        """Speed [m/s] and wheel angle [rad] that the actuators pursue during this tick."""
        lateral_acceleration = motion.vx_mps * motion.yaw_rate_radps
        self.lateral_acceleration_mps2 += 0.2 * (lateral_acceleration - self.lateral_acceleration_mps2)
        steer = self.parts.servo_ratio * self.play(self.steer_queue(steer_rad)) + self.parts.servo_trim_rad
        steer -= self.parts.steering_compliance * self.lateral_acceleration_mps2
        return self.speed_queue(speed_mps), steer
