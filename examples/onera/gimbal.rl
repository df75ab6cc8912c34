// A camera gimbal, in the short forms of ONERA's robot language.
type Float
type Image

skillset gimbal {
    data angle: Float period 250 ms
    data last_picture: Image

    resource motor {
        state { Off Still Turning }
        initial Off
        transition all
    }

    event power_on {
        guard  motor == Off
        effect motor -> Still
    }
    event power_off { effect motor -> Off }

    skill turn {
        input angle: Float
        precondition ready: motor == Still
        start motor -> Turning
        invariant powered { guard motor == Turning }
        progress {
            period 1 sec
            message remaining: Float
        }
        interrupt {
            interrupting true
            effect motor -> Still
        }
        success turned { effect motor -> Still }
        failure jammed { effect motor -> Still }
    }

    skill take_picture {
        output picture: Image
        precondition ready: not (motor == Off or motor == Turning)
        success taken {}
        failure too_dark {}
    }
}
