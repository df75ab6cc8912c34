// expect: SW004 SW005 SW002 SW020 SW027
type Float
skillset signs {
    data level: Float; data other: Float
    resource lamp {
        state { Off On }
        initial Off
        transition all
    }
    skill shine {
        precondition {
            a: lamp = Off
            b: lamp == Off [m]
        }
        success shone { effect lamp -> On }
    }
    skill glow {
        precondition {
            d: lamp < On
            e: level == Off
        }
        success shone { effect lamp -> On }
    }
}
