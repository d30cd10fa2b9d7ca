"""Independent simulations by JSBSim: its own aircraft and aerosid's, with undeclared effects.

`flight.fly_jsbsim` flies a `plan.FlightPlan`. JSBSim itself runs in a process of its own (`worker`), which imports this
package too: it therefore imports nothing here.
"""
