//! SDO accesses of a sequence.

use lexican_runtime::object::{Address, LengthMismatch, Object, Readable, Value, Writable};
use lexican_runtime::service::sdo_client::{Payload, Scalar, SdoError};
use lexican_runtime::{Duration, Instant, Measured};

use super::{Access, Bytes, DriveContext};
use crate::description::{Number, Test, Word};
use crate::error::Error;

/// The time between two positions from which a velocity is calculated: a drive slower than ten counts per second
/// stands.
const BETWEEN_POSITIONS: Duration = Duration::from_millis(200);

impl DriveContext {
    /// Reads an object.
    pub async fn read<T: Value, A: Readable, M, D>(&self, object: Object<T, A, M, D>) -> Result<T, Error> {
        let address = object.address();
        let payload = Scalar::room_for::<T>().into();
        let answer = self.transfer(Access { address, payload, writes: false }).await?;
        T::from_bytes(answer.bytes()).map_err(|error| Error::DataSheet { address, error })
    }

    /// Writes an object.
    pub async fn write<T: Value, A: Writable, M, D>(&self, object: Object<T, A, M, D>, value: T) -> Result<(), Error> {
        object.check(value)?;
        let payload = match T::SIZE {
            ..4 if self.description.always_four_bytes => Scalar::of(value.to_raw() as u32),
            _ => Scalar::of(value),
        };
        self.transfer(Access { address: object.address(), payload: payload.into(), writes: true }).await?;
        Ok(())
    }

    /// Reads the bytes of an object, eight at most, such as of a text, which has no fixed size.
    ///
    /// Errors: as [`DriveContext::read`], except for [`Error::DataSheet`].
    pub async fn read_bytes(&self, address: Address) -> Result<Vec<u8>, Error> {
        let answer =
            self.transfer(Access { address, payload: Scalar::room_for::<u64>().into(), writes: false }).await?;
        Ok(answer.bytes().to_vec())
    }

    /// Writes the bytes of an object, at most the first eight.
    pub async fn write_bytes(&self, address: Address, bytes: &[u8]) -> Result<(), Error> {
        let mut payload = Scalar::room_for::<u64>();
        payload.store(0, bytes);
        self.transfer(Access { address, payload: payload.into(), writes: true }).await?;
        Ok(())
    }

    /// Reads an object of the description.
    pub async fn get(&self, object: Number) -> Result<i64, Error> {
        let payload = match object.size() {
            1 => Scalar::room_for::<u8>(),
            2 => Scalar::room_for::<u16>(),
            4 => Scalar::room_for::<u32>(),
            _ => Scalar::room_for::<u64>(),
        };
        let payload = payload.into();
        let answer = self.transfer(Access { address: object.address(), payload, writes: false }).await?;
        let mut raw = [0; 8];
        let bytes = answer.bytes();
        if bytes.len() != object.size() {
            let error = LengthMismatch { expected: object.size(), got: bytes.len() };
            return Err(Error::DataSheet { address: object.address(), error });
        }
        raw.iter_mut().zip(bytes).for_each(|(to, from)| *to = *from);
        Ok(object.decode(u64::from_le_bytes(raw)))
    }

    /// Reads at most 64 bytes of a text.
    pub(crate) async fn text(&self, address: Address) -> Result<Vec<u8>, Error> {
        let answer = self.transfer(Access { address, payload: Bytes::of_text(), writes: false }).await?;
        Ok(answer.bytes().to_vec())
    }

    /// Writes an object of the description.
    pub async fn set(&self, object: Number, value: i64) -> Result<(), Error> {
        object.check(value)?;
        let payload = self.payload(object, value);
        self.transfer(Access { address: object.address(), payload: payload.into(), writes: true }).await?;
        Ok(())
    }

    /// Writes the bytes of an object.
    pub(crate) async fn download(&self, address: Address, value: Scalar) -> Result<(), Error> {
        let payload = match (self.description.always_four_bytes, value.bytes()) {
            (true, &[a]) => Scalar::of(u32::from(a)),
            (true, &[a, b]) => Scalar::of(u32::from(u16::from_le_bytes([a, b]))),
            _ => value,
        };
        self.transfer(Access { address, payload: payload.into(), writes: true }).await?;
        Ok(())
    }

    pub(super) fn payload(&self, object: Number, value: i64) -> Scalar {
        let raw = object.encode(value);
        match object.size() {
            ..4 if self.description.always_four_bytes => Scalar::of(raw as u32),
            1 => Scalar::of(raw as u8),
            2 => Scalar::of(raw as u16),
            4 => Scalar::of(raw as u32),
            _ => Scalar::of(raw),
        }
    }

    /// Reads the actual position (6064h).
    pub async fn position(&self) -> Result<i32, Error> {
        let position = narrow(self.get(self.description.objects.actual_position).await?);
        let mut shared = self.lock();
        shared.seen.position = Some(Measured::new(position, shared.now));
        Ok(position)
    }

    /// The actual velocity (606Ch), or 0 if it is low enough to count as standing. Without 606Ch, the position is read
    /// twice; a drive stands if it moved by at most one count.
    pub async fn velocity(&self) -> Result<i32, Error> {
        let velocity = match self.description.objects.actual_velocity {
            Some(object) => narrow(self.get(object).await?),
            None => self.measured_velocity().await?,
        };
        let velocity = if velocity.unsigned_abs() <= self.description.status.standing { 0 } else { velocity };
        let mut shared = self.lock();
        shared.seen.velocity = Some(Measured::new(velocity, shared.now));
        Ok(velocity)
    }

    /// In counts of 6064h per second. Both positions are read here, since an older one might be from before the last
    /// order.
    async fn measured_velocity(&self) -> Result<i32, Error> {
        let (began, from) = (self.now(), self.position().await?);
        self.pass(BETWEEN_POSITIONS).await?;
        let way = i64::from(self.position().await?) - i64::from(from);
        let span = self.now().since(began).as_micros().max(1) as i64;
        Ok(if way.abs() <= 1 { 0 } else { narrow(way * 1_000_000 / span) })
    }

    /// Whether a condition on status bits holds; `status_word` is the present one.
    pub async fn holds(&self, test: Test, status_word: u16) -> Result<bool, Error> {
        Ok(test.holds(match test.word {
            Word::Status => status_word.into(),
            Word::System => self.system().await?,
        }))
    }

    /// The manufacturer's status register; 0 for a drive without one.
    pub async fn system(&self) -> Result<u32, Error> {
        match self.description.objects.system_word {
            Some(object) => Ok(self.get(object).await? as u32),
            None => Ok(0),
        }
    }

    pub(crate) async fn transfer(&self, access: Access) -> Result<Bytes, Error> {
        {
            let mut shared = self.lock();
            shared.answer = None;
            shared.access = Some(access);
            shared.is_transferring = true;
        }
        let answer = self.wait(Instant::from_micros(u64::MAX), |shared| shared.answer.take()).await;
        self.lock().is_transferring = false;
        let answer = answer?;
        // The SDO client times out long before this deadline.
        Ok(answer.unwrap_or(Err(SdoError::TimedOut { address: access.address }))?)
    }
}

/// Positions and velocities have 32 bits in CiA 402; [`Description::findings`](crate::Description::findings) reports a
/// description with others.
pub(crate) fn narrow(value: i64) -> i32 {
    value.clamp(i32::MIN.into(), i32::MAX.into()) as i32
}
