"""Independent flights by JSBSim: its own aircraft and aerosid's, with effects that no aircraft file mentions.

`flight.fly_jsbsim` flies a `plan.FlightPlan`. JSBSim itself runs in a process of its own (`worker`), which imports this
package too: nothing is imported here.
"""
