// A warehouse forklift in ONERA's robot language.

type {
    Float
    Pose
    PalletId
}

skillset forklift {
    data {
        battery: Float period 1.0
        pose:    Pose  period 100 ms
        load:    Float
    }

    resource {
        drive {
            state { Free Used }
            initial Free
            transition all
        }
        forks {
            state { Empty Moving Loaded }
            initial Empty
            transition {
                Empty  -> Moving
                Loaded -> Moving
                Moving -> Empty
                Moving -> Loaded
            }
        }
        operator {
            state { Absent OnBoard }
            initial Absent
            transition all
        }
        charge {
            state { Good Low Critical }
            initial Good
            transition {
                Good     -> Low
                Low      -> Critical
                Low      -> Good
                Critical -> Low
            }
        }
        // Nothing here changes it: the safety controller does.
        bumper {
            state { Clear Pressed }
            initial Clear
            transition all
        }
    }

    event {
        operator_boards { effect operator -> OnBoard }
        operator_leaves {
            guard  operator == OnBoard and drive == Free
            effect operator -> Absent
        }
        battery_low {
            guard  charge == Good or charge == Critical
            effect charge -> Low
        }
        battery_critical { effect charge -> Critical }
        battery_good {
            guard  charge == Low
            effect charge -> Good
        }
    }

    skill drive_to {
        input {
            target: Pose
            speed:  Float
        }
        output stopped_at: Pose
        precondition {
            alone:   operator == Absent
            free:    drive == Free
            clear:   bumper == Clear
            charged: charge != Critical
        }
        start drive -> Used
        invariant {
            alone {
                guard  operator == Absent
                effect drive -> Free
            }
            clear {
                guard  bumper == Clear
                effect drive -> Free
            }
        }
        progress {
            period 0.5
            output distance: Float
        }
        interrupt {
            interrupting true
            effect drive -> Free
        }
        success arrived { effect drive -> Free }
        failure {
            blocked {
                effect drive -> Free
                postcondition bumper == Clear
            }
            lost_track { effect drive -> Free }
        }
    }

    skill lift {
        input pallet: PalletId
        precondition {
            empty: forks == Empty
            still: drive == Free
            clear: bumper == Clear
        }
        start {
            forks -> Moving
            drive -> Used
        }
        invariant safe {
            guard operator == OnBoard or bumper == Clear
            effect {
                forks -> Empty
                drive -> Free
            }
        }
        progress {
            period 200 ms
            message {
                height: Float
                weight: Float
            }
        }
        interrupt {
            interrupting true
            effect {
                forks -> Empty
                drive -> Free
            }
        }
        success lifted {
            effect {
                forks -> Loaded
                drive -> Free
            }
        }
        failure too_heavy {
            effect {
                forks -> Empty
                drive -> Free
            }
        }
    }

    skill set_down {
        precondition loaded: forks == Loaded
        start forks -> Moving
        interrupt {
            interrupting false
            effect forks -> Loaded
        }
        success set_down { effect forks -> Empty }
        failure stuck    { effect forks -> Loaded }
    }
}
