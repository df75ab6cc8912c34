"""Firmware of the simulated flight controller: control cascade, mixer, failsafes, fence guard, rotor watch."""
