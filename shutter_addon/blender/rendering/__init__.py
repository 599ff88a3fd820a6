"""From an effect to its pictures and films: engine, devices, sessions, render jobs."""
