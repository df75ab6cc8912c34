// expect: SW003 SW005 SW002 SW005 SW004
type Float
skillset broken {
    resource lamp {
        state { Off On }
        intial Off
        transition all
    }
    event glow {
        guard lamp = Off
        effect lamp -> On
    }
    skill shine {
        effect lamp -> On
        precondition dark lamp == Off
        success shone { effect lamp -> On; }
    }
}
