"""The rig as a service: jobs, their records and files, and the HTTP interface to them. Holds no physics."""
